"""How far the field's lines lie in a picture from where a calibration has them: px in the picture, mm on the carpet.

At even steps along every marking of the region the painted line is measured across its direction, where the model
expects it. A camera that was knocked shows it elsewhere, so the search widens step by step; what was found far away
first tells how the picture as a whole has moved, and is then measured again, near that place. A marking that is not
there while others are is looked for by itself, further off: a model that was never right inside the field has its
borders where they are, and nothing else.

The same search begins where a calibration's own points lay, and tells how far the lines lie from there: whatever the
model makes of them, that is a change since then.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, fields
from functools import partial
from typing import Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Pixels, Points, inside_picture
from touchline.core.records import Observations
from touchline.evaluate.field_lines.expected import ObservedLines, expected_lines
from touchline.evaluate.offsets import OffsetField, OffsetMeasurements, fit_offset_field
from touchline.evaluate.residuals import rms
from touchline.evaluate.verification import MARKING_FOUND
from touchline.fitting.field_pattern import LineSamples, fine_pattern
from touchline.models import CameraModel, field_from_raw
from touchline.vision.profiles import GROUND_PX, STEP_PX, across_lines, brightness_across, strays

# How far beside its place a line is looked for, px of a picture that is 1280 px wide; there is always another step.
SEARCH_PX = (4.0, 12.0, 32.0)  # all lines: each step about three times the last
SINGLE_SEARCH_PX = (12.0, 32.0, 64.0)  # one marking by itself
REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO = 1280, 0.8  # a small picture is searched as if it were so wide
MAX_PLACES = 360  # of all lines together
MIN_APART_PX = 6.0  # between places
MIN_CLEAR_PX = 4.0  # to the paint of another line
IMAGE_MARGIN_PX = 2
# Shares of the expected length.
MIN_GAIN = 0.04  # less gained by a wider search is chance
ENOUGH_SHARE = 0.85  # found near by: nothing is looked for further off
MIN_SHARE = 0.5  # found: with less, nothing can be said of single markings
# of a marking's length: found so far, it is this marking, further off, and no chance
MIN_SINGLE_SHARE = 0.7
MIN_MARKING_POINTS, MIN_OBSERVED_POINTS = 3, 2
# a line of fewer places is found only where so much of it is
SHORT_PLACES, MIN_SHORT_SHARE = 12, 0.5
MIN_MOTION_POINTS = 12  # measures that tell how a picture has moved
BORDER_MM = 50.0  # nearer to a border, a line is the border
MAX_BARE_CONTRAST = 0.12  # of the paint's usual contrast: what varies less is carpet


@dataclass(frozen=True, eq=False)
class LineMeasurements:
    """Where each marking was looked for and seen; (n,) each, NaN where it was not found.

    expected_px: (n, 2) where the model has it; normal_px: (n, 2) across it; raw: (n, 2) px found; off_px: signed, along
    the normal; foot: (n, 2) mm on the marking; normal_mm: (n, 2) across it on the carpet; off_mm: signed;
    stands_for_px: the length of marking that a measurement represents; bare: whether carpet is seen where the line
    should be, with nothing in the way; inside: whether it is expected inside the region's borders, not on them.
    """

    names: tuple[str, ...]
    marking: Indices
    expected_px: Points
    normal_px: Points
    raw: Points
    off_px: Array
    foot: Points
    normal_mm: Points
    off_mm: Array
    stands_for_px: Array
    bare: Mask
    inside: Mask

    @property
    def found(self) -> Mask:
        return np.isfinite(self.off_mm)

    @property
    def share(self) -> float:
        """Of the expected length, what was found; 0 where nothing is expected."""
        return float(self.stands_for_px[self.found].sum() / max(self.stands_for_px.sum(), 1e-9))

    def found_shares(self) -> Array:
        """Return, for each of the names, the share of its expected length that was found; NaN for one not expected."""
        expected, seen = (
            np.bincount(self.marking[of], self.stands_for_px[of], minlength=len(self.names))
            for of in (slice(None), self.found)
        )
        with np.errstate(invalid="ignore"):
            return seen / np.where(expected > 0, expected, np.nan)

    @property
    def missing(self) -> Mask:
        """Of each of the names: it should be in sight, nothing covers most of it, and it is not there."""
        unseen = ~self.found
        unseen_px, bare_px = (
            np.bincount(self.marking[some], self.stands_for_px[some], minlength=len(self.names))
            for some in (unseen, unseen & self.bare)
        )
        return (self.found_shares() < MARKING_FOUND) & (bare_px > unseen_px / 2)

    @property
    def missing_share(self) -> float:
        """Of the expected length, what is in markings that are missing."""
        return self._missing_of(np.ones_like(self.inside))

    @property
    def missing_inside(self) -> float:
        """The same, of what is inside the region's borders."""
        return self._missing_of(self.inside)

    def _missing_of(self, some: Mask) -> float:
        missing = some & self.missing[self.marking]
        return float(self.stands_for_px[missing].sum() / max(self.stands_for_px[some].sum(), 1e-9))

    def with_markings_of(self, other: Self, numbers: Indices) -> Self:
        """Return these, but of those markings the other's."""
        own, others = ~np.isin(self.marking, numbers), np.isin(other.marking, numbers)
        return type(self)(
            self.names,
            *(
                np.concatenate([getattr(self, name)[own], getattr(other, name)[others]])
                for name in PER_PLACE
            ),
        )

    def evidence(self) -> OffsetMeasurements:
        """Return what was found as offset measurements on the carpet; FitFailed where nothing was."""
        of = self.found
        nothing = np.zeros(int(of.sum()))
        return OffsetMeasurements.together(
            [
                OffsetMeasurements.of_lines(
                    self.foot[of], self.normal_mm[of], nothing, self.off_mm[of]
                )
            ]
        )


PER_PLACE = tuple(member.name for member in fields(LineMeasurements) if member.name != "names")


def measure_lines(
    model: CameraModel, gray: Pixels, field: Field, region: Region
) -> LineMeasurements:
    """Measure all lines of the region: the narrowest search that finds enough, or about as much as any.

    gray (h, w), with its lines bright.
    """
    return _measure_all(_Search.of_markings(model, gray, field, region))


def measure_single_markings(
    model: CameraModel,
    gray: Pixels,
    field: Field,
    region: Region,
    names: Collection[str],
) -> LineMeasurements:
    """Measure these markings only, each further and further off: by the others, the camera is where it was."""
    search = _Search.of_markings(model, gray, field, region)
    numbers = np.flatnonzero([name in names for name in search.names])
    near = search.measure(None, SEARCH_PX[0], numbers)

    def hardly_found(found: LineMeasurements) -> Indices:
        # where nothing could be looked for, the share is NaN, and no comparison holds
        return numbers[~(found.found_shares()[numbers] > MIN_SINGLE_SHARE)]

    return _measure_singly(search, near, None, hardly_found)


def measure_change(
    model: CameraModel,
    gray: Pixels,
    field: Field,
    region: Region,
    observations: Observations,
) -> LineMeasurements | None:
    """Measure how far the lines lie from where they were observed, off_px and off_mm; None where that is not known.

    observations: on carpet; without their outliers.
    """
    size = ImageSize(gray.shape[1], gray.shape[0])
    then = ObservedLines.of(model, field, region, observations, size, MAX_PLACES)
    return (
        None
        if then is None
        else _measure_all(
            _Search(
                model,
                gray,
                region,
                size,
                then.features,
                then.names,
                then.samples,
                MIN_OBSERVED_POINTS,
                is_since=True,
            )
        )
    )


def _measure_all(search: "_Search") -> LineMeasurements:
    """Measure all lines, after the motion of the whole picture that shows most of them."""
    best, best_motion = search.measure(None, SEARCH_PX[0]), None
    for distance_px in SEARCH_PX[1:]:
        if best.share > ENOUGH_SHARE:
            break
        # Far off, a line may be taken for its neighbour. Together they still tell how the picture moved, and near
        # that place each is measured again.
        motion = _fit_motion(search.measure(None, distance_px))
        if motion is None:
            continue
        again = search.measure(motion, SEARCH_PX[0])
        if again.share > best.share + MIN_GAIN:
            best, best_motion = again, motion
    if best.share < MIN_SHARE:
        return best
    return _measure_singly(search, best, best_motion, lambda found: np.flatnonzero(found.missing))


def _measure_singly(
    search: "_Search",
    best: LineMeasurements,
    motion: OffsetField | None,
    unfound: Callable[[LineMeasurements], Indices],
) -> LineMeasurements:
    """Look for single markings further and further off. unfound: the numbers of those that are still looked for."""
    for distance_px in SINGLE_SEARCH_PX:
        numbers = unfound(best)
        if not len(numbers):
            break
        far = search.measure(motion, distance_px, numbers)
        best = best.with_markings_of(far, np.flatnonzero(far.found_shares() > MIN_SINGLE_SHARE))
    return best


def _fit_motion(measured: LineMeasurements) -> OffsetField | None:
    """Fit how the picture as a whole has moved, px; None for too few measurements."""
    of = measured.found
    if of.sum() < MIN_MOTION_POINTS:
        return None
    return fit_offset_field(
        OffsetMeasurements.of_lines(
            measured.expected_px[of],
            measured.normal_px[of],
            np.zeros(int(of.sum())),
            measured.off_px[of],
        )
    )


@dataclass(frozen=True, eq=False)
class _Search:
    """samples: the places to look at, of these features, by how many px they are to be clear of others.

    is_since: offsets are from those very places, and not from the features.
    """

    model: CameraModel
    gray: Pixels
    region: Region
    size: ImageSize
    features: tuple[Line | Arc, ...]
    names: tuple[str, ...]
    samples: Callable[[float], LineSamples]
    min_points: int  # of a marking
    is_since: bool

    @classmethod
    def of_markings(cls, model: CameraModel, gray: Pixels, field: Field, region: Region) -> Self:
        """For the field's markings where the model has them."""
        size, pattern = ImageSize(gray.shape[1], gray.shape[0]), fine_pattern(field)
        samples = partial(
            expected_lines, model, pattern, size, MAX_PLACES, MIN_APART_PX, region=region
        )
        names = tuple(marking.name for marking in pattern.markings)
        return cls(
            model,
            gray,
            region,
            size,
            pattern.markings,
            names,
            samples,
            MIN_MARKING_POINTS,
            is_since=False,
        )

    def measure(
        self,
        motion: OffsetField | None,
        distance_px: float,
        only: Indices | None = None,
    ) -> LineMeasurements:
        """Measure lines within distance_px of where they are expected, after a motion of the whole picture.

        only: of these markings, by number.
        """
        reach_px = distance_px * max(self.size.width / REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO)
        # A line within reach of its neighbour could be taken for it, unless all are where their motion puts them.
        is_near = motion is not None and only is None
        at = self.samples(MIN_CLEAR_PX if is_near else max(MIN_CLEAR_PX, reach_px))
        if only is not None:
            at = at.of(np.isin(at.marking, only))
        start = at.places if motion is None else at.places + np.nan_to_num(motion.at(at.places)[0])
        profiles = across_lines(self.gray, start, at.normals, at.width_px, at.marking, reach_px)
        hits = profiles.found & at.clear & inside_picture(start, self.size, IMAGE_MARGIN_PX)
        hits &= ~strays(profiles.middle, hits, at.marking)
        hits = self._without_chance_hits(hits, at)
        raw = start + np.where(hits, profiles.middle, np.nan)[:, None] * at.normals
        usual = float(np.median(profiles.contrast[hits])) if hits.any() else 0.0
        bare = ~hits & self._bare(start, at, MAX_BARE_CONTRAST * usual)
        return self._measurements(at, raw, bare)

    def _without_chance_hits(self, hits: Mask, at: LineSamples) -> Mask:
        """Return the hits without those of markings that have too few."""
        for number in range(len(self.features)):
            of = at.marking == number
            # From where the line was seen before, both its place and its normal are those of then; from a feature, the
            # nearest place of it is the foot, and the normal the one where the line is expected.
            # Of a short line, a few places that agree may be a robot's edge.
            is_short = of.sum() < SHORT_PLACES
            min_points = (
                max(self.min_points, MIN_SHORT_SHARE * of.sum()) if is_short else self.min_points
            )
            if (hits & of).sum() < min_points:
                hits = hits & ~of
        return hits

    def _bare(self, places: Points, at: LineSamples, max_spread: float) -> Mask:
        """Return (n,) whether the brightness across each place is that of carpet alone. max_spread: grey levels."""
        reach = at.width_px / 2 + GROUND_PX
        away = np.arange(-reach.max(initial=1.0), reach.max(initial=1.0) + STEP_PX / 2, STEP_PX)
        rows = brightness_across(self.gray, places, at.normals, away)
        rows = np.where(np.abs(away) <= reach[:, None], rows, np.nan)
        return inside_picture(places, self.size, IMAGE_MARGIN_PX) & (
            np.nanstd(rows, axis=1) < max_spread
        )

    def _measurements(self, at: LineSamples, raw: Points, bare: Mask) -> LineMeasurements:
        """Return how far the lines at raw (n, 2) px, NaN where not found, lie from their places, px and mm."""
        clear = at.clear
        on_carpet, expected = field_from_raw(self.model, raw), field_from_raw(self.model, at.places)
        foot, normal = np.full_like(on_carpet, np.nan), np.full_like(on_carpet, np.nan)
        for number, marking in enumerate(self.features):
            of = at.marking == number
            # From where the line was seen before, both its place and its normal are those of then; from a feature, the
            # nearest place of it is the foot, and the normal the one where the line is expected.
            foot[of] = expected[of] if self.is_since else marking.nearest(on_carpet[of])
            normal[of] = marking.normals(
                marking.nearest(expected[of]) if self.is_since else expected[of]
            )
        off_mm = np.sum((on_carpet - foot) * normal, axis=1)
        off_px = np.sum((raw - at.places) * at.normals, axis=1)
        return LineMeasurements(
            self.names,
            at.marking[clear],
            at.places[clear],
            at.normals[clear],
            raw[clear],
            off_px[clear],
            foot[clear],
            normal[clear],
            off_mm[clear],
            at.length_px[clear],
            bare[clear],
            self._inside(expected[clear]),
        )

    def _inside(self, places: Points) -> Mask:
        """Return (n,) whether places (n, 2) mm are inside the region's borders, and not on them."""
        low, high = np.transpose([self.region.x_mm, self.region.y_mm])
        return ((places > low + BORDER_MM) & (places < high - BORDER_MM)).all(axis=1)


class LineDeviation(TypedDict):
    """One marking: places looked at and found, and how far beside it lies; mean_mm is signed, to its left.

    Lengths in mm are across it on the carpet; None where nothing was found.
    """

    feature: str
    places: int
    found: int
    found_share: float
    mean_mm: float | None
    rms_mm: float | None
    worst_mm: float | None
    rms_px: float | None


def line_deviations(measured: LineMeasurements) -> list[LineDeviation]:
    """Return the deviation of every marking that the picture should show, in the field's order."""
    deviations: list[LineDeviation] = []
    for number, name in enumerate(measured.names):
        of = measured.marking == number
        if not of.any():
            continue
        hits = of & measured.found
        share = float(
            measured.stands_for_px[hits].sum() / max(measured.stands_for_px[of].sum(), 1e-9)
        )
        mm, px = measured.off_mm[hits], measured.off_px[hits]
        deviations.append(
            {
                "feature": name,
                "places": int(of.sum()),
                "found": int(hits.sum()),
                "found_share": share,
                "mean_mm": float(mm.mean()) if len(mm) else None,
                "rms_mm": rms(mm),
                "worst_mm": float(np.abs(mm).max()) if len(mm) else None,
                "rms_px": rms(px),
            }
        )
    return deviations
