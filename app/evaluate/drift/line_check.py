"""How far the field's lines lie in a picture from where a calibration has them: px in the picture, mm on the carpet.

At even steps along every marking of the region the painted line is measured across its direction, where the model
expects it. A camera that was knocked shows it elsewhere, so the search widens step by step; what was found far away
first tells how the picture as a whole has moved, and is then measured again, near that place.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.core.field import Field, Region
from app.core.geometry import Array, ImageSize, Points, inside_picture
from app.evaluate.cameras.evidence import OffsetMeasurements
from app.evaluate.cameras.offsets import OffsetField, fit_offset_field
from app.evaluate.drift.expected import expected_lines
from app.fitting.field_lines.line_samples import LineSamples, fine_pattern
from app.fitting.field_lines.pattern import FieldPattern
from app.models import CameraModel, field_from_raw
from app.vision.lines.profiles import across_lines
from app.vision.lines.strays import strays

CAPTURES_PX = (4.0, 12.0, 32.0)  # in a picture of 1280 px, each about three times the last
PLACES = 360  # in all
APART_PX = 6.0
CLEAR_PX = 4.0
BETTER = 0.04  # of the expected length: less gained by a wider search is chance
PLENTY = 0.85  # of the expected length, found near by: nothing is looked for further off
MIN_MARKING_POINTS = 3
MIN_MOTION_POINTS = 12  # measures that tell how a picture has moved


@dataclass(frozen=True, eq=False)
class LineMeasurements:
    """Where each marking was looked for and seen; (n,) each, NaN where it was not found.

    expected_px: (n, 2) where the model has it; normal_px: (n, 2) across it; raw: (n, 2) px found; off_px: signed, along
    the normal; foot: (n, 2) mm on the marking; normal_mm: (n, 2) across it on the carpet; off_mm: signed;
    stands_for_px: the length of marking that a measurement represents.
    """

    names: tuple[str, ...]
    marking: NDArray[np.intp]
    expected_px: Points
    normal_px: Points
    raw: Points
    off_px: Array
    foot: Points
    normal_mm: Points
    off_mm: Array
    stands_for_px: Array

    @property
    def found(self) -> NDArray[np.bool_]:
        return np.isfinite(self.off_mm)

    @property
    def share(self) -> float:
        """Of the expected length, what was found; 0 where nothing is expected."""
        return float(self.stands_for_px[self.found].sum() / max(self.stands_for_px.sum(), 1e-9))

    def evidence(self) -> OffsetMeasurements:
        """Return what was found as offset measurements on the carpet; FitFailed where nothing was."""
        of = self.found
        nothing = np.zeros(int(of.sum()))
        return OffsetMeasurements.together([OffsetMeasurements.of_lines(self.foot[of], self.normal_mm[of], nothing,
                                                                        self.off_mm[of])])


def measure_lines(model: CameraModel, gray: NDArray[np.uint8], field: Field, region: Region) -> LineMeasurements:
    """(h, w) grey. The narrowest search that finds plenty, or about as much as any."""
    size = ImageSize(gray.shape[1], gray.shape[0])
    search = _Search(model, gray, field, region, size)
    best = search.near(None, CAPTURES_PX[0])
    for capture in CAPTURES_PX[1:]:
        if best.share > PLENTY:
            break
        far = search.near(None, capture)
        moved = _moved(far)
        if moved is None:
            continue
        again = search.near(moved, CAPTURES_PX[0])
        if again.share > best.share + BETTER:
            best = again
    return best


def _moved(measured: LineMeasurements) -> OffsetField | None:
    """Fit how the picture as a whole has moved, px; None for too few measurements."""
    of = measured.found
    if of.sum() < MIN_MOTION_POINTS:
        return None
    return fit_offset_field(OffsetMeasurements.of_lines(measured.expected_px[of], measured.normal_px[of],
                                                        np.zeros(int(of.sum())), measured.off_px[of]))


@dataclass(frozen=True, eq=False)
class _Search:
    model: CameraModel
    gray: NDArray[np.uint8]
    field: Field
    region: Region
    size: ImageSize

    @cached_property
    def pattern(self) -> FieldPattern:
        return fine_pattern(self.field)

    def near(self, moved: OffsetField | None, capture_px: float) -> LineMeasurements:
        """Measure lines within capture_px of where they are expected, after a motion of the whole picture."""
        pattern = self.pattern
        capture = capture_px * max(self.size.width / 1280, 0.8)
        clear_px = max(CLEAR_PX, capture if moved is None else CLEAR_PX)
        at = expected_lines(self.model, pattern, self.size, PLACES, APART_PX, clear_px, self.region)
        start = at.places if moved is None else at.places + np.nan_to_num(moved.at(at.places)[0])
        profiles = across_lines(self.gray, start, at.normals, at.width_px, at.marking, capture)
        hits = profiles.found & at.clear & inside_picture(start, self.size, 2)
        hits &= ~strays(profiles.middle, hits, at.marking)
        for number in range(len(pattern.markings)):
            if (hits & (at.marking == number)).sum() < MIN_MARKING_POINTS:
                hits &= at.marking != number
        raw = start + np.where(hits, profiles.middle, np.nan)[:, None] * at.normals
        return self._measurements(pattern, at, raw)

    def _measurements(self, pattern: FieldPattern, at: LineSamples, raw: Points) -> LineMeasurements:
        clear = at.clear
        spot, there = field_from_raw(self.model, raw), field_from_raw(self.model, at.places)
        foot, normal = np.full_like(spot, np.nan), np.full_like(spot, np.nan)
        for number, marking in enumerate(pattern.markings):
            of = at.marking == number
            foot[of], normal[of] = marking.nearest(spot[of]), marking.normals(there[of])
        off_mm = np.sum((spot - foot) * normal, axis=1)
        off_px = np.sum((raw - at.places) * at.normals, axis=1)
        return LineMeasurements(tuple(m.name for m in pattern.markings), at.marking[clear], at.places[clear],
                                at.normals[clear], raw[clear], off_px[clear], foot[clear], normal[clear], off_mm[clear],
                                at.length_px[clear])


@dataclass(frozen=True)
class LineDeviation:
    """One marking: places looked at and found, and how far beside it lies; mean_mm is signed, to its left."""

    feature: str
    places: int
    found: int
    found_share: float
    mean_mm: float | None
    rms_mm: float | None
    worst_mm: float | None
    rms_px: float | None


def line_deviations(measured: LineMeasurements) -> Iterator[LineDeviation]:
    """Yield the deviation of every marking that the picture should show, in the field's order."""
    for number, name in enumerate(measured.names):
        of = measured.marking == number
        if not of.any():
            continue
        hits = of & measured.found
        share = float(measured.stands_for_px[hits].sum() / max(measured.stands_for_px[of].sum(), 1e-9))
        mm, px = measured.off_mm[hits], measured.off_px[hits]
        figures = (None,) * 4 if not len(mm) else (float(mm.mean()), float(np.sqrt(np.mean(mm**2))),
                                                   float(np.abs(mm).max()), float(np.sqrt(np.mean(px**2))))
        yield LineDeviation(name, int(of.sum()), int(hits.sum()), share, *figures)
