"""How far a camera's picture has moved since the field's lines were seen in it, at next to no cost.

    reference = LineReference.of(pictures, model, field, region)     once: where the lines are, and what they look like
    sample = reference.look(picture, sample before)                  each second: how far the picture has moved

Lines are looked for where the calibration expects them, and followed from where they *were seen*: what the model does
not tell exactly is no motion. Places covered by robots and people disagree with the others and are rejected.
"""

from dataclasses import dataclass
from dataclasses import field as dataclass_field
from typing import Literal

import numpy as np

from touchline.core import opencv
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize, Mask, Pixels, Points, inside_picture
from touchline.evaluate.field_lines.expected import expected_lines, lines_in
from touchline.evaluate.field_lines.orientation import OrientationReference
from touchline.fitting.field_pattern import LineSamples, fine_pattern
from touchline.fitting.image_motion import (
    ImageMotion,
    MotionField,
    MotionSize,
    RegionSamples,
    estimate_motion,
)
from touchline.models import CameraModel, field_from_raw
from touchline.vision.patches import LinePatches, LineShifts
from touchline.vision.profiles import brightness_across
from touchline.vision.ridges import with_bright_lines

# The reference.
MAX_PLACES, MIN_PLACES = 160, 12
MIN_APART_PX, MIN_CLEAR_PX = 6.0, 7.0
# of the picture's width, 9 px of 1280: so far beside its place a line may be, but within
MAX_MODEL_ERROR = 0.007
MODEL_ERROR_PX = (3.0, 12.0)
MIN_CONTRAST = 8.0  # grey levels
REGION_GRID = (13, 9)  # places over the region, for how far it has moved

# A look at it.
MIN_SEEN, MIN_SEEN_SHARE = 8, 0.25  # of its places, to measure a motion
MAX_STEPS = 3
STILL_PX = 0.15  # moved less, a look from the nominal places is as good as from the moved ones
MIN_SOFTER_PX = 1.0  # σ: softer than that by a bump, not by the night's cold
# mean grey level about the lines, and of what it was: dark is below both
DARK_LEVEL, DARK_SHARE = 14.0, 0.35
# σ softer, tried where hardly anything looks as it did
OTHER_FOCUS_PX = (1.0, 2.0, 4.0, -1.0, -2.0)
# times what a measurement needs: with fewer places, another focus or a motion further off is tried
FEW = 2
MIN_TIMES_MORE = 1.5  # so many more places must be seen with it, to believe that
# of the share that is seen of lines the other way: with less, they may have moved out of reach
MIN_OTHER_WAY = 0.5
MIN_PLACES_ONE_WAY = 4  # that tell of lines one way

# Lines that are covered, against lines that are gone.
# of the places that are seen; by chance it would be an eighth, STILL_PX of patches.MAX_OFFSET_PX
MAX_STILL_SHARE = 0.6
THUMBNAIL_PX = 32
# correlation of the whole picture, very small: the same scene, perhaps with people in the way
MIN_LIKENESS = 0.6
MAX_BARE_SHARE = 0.4  # of the places that show ground without a line

# What is taken for a motion.
MOVED_PX, MOVED_MM = 0.5, 1.5  # either is one: half of what must be found
MIN_MOVED_PX = 0.1  # less is none, however many mm a pixel is
MIN_SIGMAS = 6.0

# The search for lines further away.
SEARCH_SHARE = 0.08  # of the picture's width
MIN_SEARCH_PX, MAX_SEARCH_PX = 16, 120
SHIFT_STEP_PX = 2
MAX_DISAGREEMENT_PX = 2  # of a place with the shift of the picture: a turn, a lens
MIN_CORRELATION = 0.75
NEAR_SHIFT_PX = 6  # about the shift, each place's own best is looked for
SEARCH_SIGMA_PX = 1.0
MIN_PLACES_FOUND = 8
# Of the line's contrast, squared: a fifth of it at least, for noise may look like anything.
MIN_STRENGTH = 0.04

NO_PLACES = np.empty((0, 2))

Kind = Literal["seen", "soft", "covered", "gone", "dark", "turned", "mirrored"]


@dataclass(frozen=True, eq=False)
class MotionSample:
    """What one look found. moved: how far the picture did, None where unknown; sigmas: how sure that is, in σ.

    seen: count of places with their lines. softer_px: σ by which lines are softer than they were, negative for sharper.
    places, shifts (n, 2) px: the places that agree, and how far each moved: across its line as measured, along it as
    the whole picture did.
    """

    kind: Kind
    seen: int
    moved: MotionSize | None = None
    motion: ImageMotion | None = None
    sigmas: float = 0.0
    softer_px: float = 0.0
    places: Points = dataclass_field(default_factory=lambda: NO_PLACES)
    shifts: Points = dataclass_field(default_factory=lambda: NO_PLACES)

    def has_moved(self, share: float = 1.0) -> bool:
        """Return whether the lines are seen as sharp as they were, and elsewhere. share: of the usual limits."""
        if self.kind != "seen" or (moved := self.moved) is None:
            return False
        is_far = moved.px >= share * MOVED_PX or moved.mm >= share * MOVED_MM
        return is_far and moved.px >= share * MIN_MOVED_PX and self.sigmas >= MIN_SIGMAS


@dataclass(frozen=True, eq=False)
class LineReference:
    """Tracked lines. across (n, 4): n · B, how a motion q (4,) of the picture moves each place across its line, by
    fitting.image_motion; level: mean grey about the lines.

    samples: of the region, which tell how far it has moved. thumbnail: the picture, very small. orientation: what tells
    whether the picture was turned or mirrored, which the lines do not.
    """

    patches: LinePatches
    across: Array
    samples: RegionSamples
    level: float
    thumbnail: Array
    size: ImageSize
    orientation: OrientationReference

    @classmethod
    def of(
        cls,
        pictures: list[Pixels],
        model: CameraModel,
        field: Field,
        region: Region,
    ) -> "LineReference | None":
        """Make it from one picture or several of the same scene; None where too few lines are where expected."""
        size = ImageSize(pictures[0].shape[1], pictures[0].shape[0])
        flow = MotionField(model, (size.width, size.height))
        x, y = np.meshgrid(
            np.linspace(*region.x_mm, REGION_GRID[0]), np.linspace(*region.y_mm, REGION_GRID[1])
        )
        samples = RegionSamples.of(flow, np.stack([x.ravel(), y.ravel()], axis=-1))
        lines = _find_lines(with_bright_lines(pictures[0]), model, field, size)
        if samples is None or not len(lines.places):
            return None
        patches = LinePatches.of(pictures, lines.places, lines.normals, lines.width_px)
        shifts_by_q = flow.at(lines.places)
        good = np.isfinite(shifts_by_q).all(axis=(1, 2)) & (patches.contrast > MIN_CONTRAST)
        if good.sum() < MIN_PLACES:
            return None
        patches = LinePatches(
            patches.places[good],
            patches.normals[good],
            patches.away,
            patches.rows[good],
            patches.weight[good],
            patches.contrast[good],
        )
        across = np.einsum("ni,nik->nk", patches.normals, shifts_by_q[good])
        return cls(
            patches,
            across,
            samples,
            float(patches.rows.mean()),
            _thumbnail(pictures[0]),
            size,
            OrientationReference.of(pictures[0], model, region),
        )

    def look(self, picture: Pixels, before: MotionSample | None = None) -> MotionSample:
        """Measure where the lines are now. before: the sample of the last look.

        picture (h, w[, 3]), of the reference's size.
        """
        if self._is_dark(picture):
            return MotionSample("dark", 0)
        view = self._nearby_view(picture, before)
        elsewhere = None
        if view.count < FEW * self.min_seen:
            elsewhere = find_motion(self.patches, self.across, picture)
            view = self._better_view(picture, view, elsewhere)
        sample, seen_by_way = self._measure(picture, view)
        if sample is None:
            return self._unmeasured(picture, view)
        if (way := self.orientation.compare(picture, self.samples.flow.model).way) is not None:
            return MotionSample(way, sample.seen)
        if elsewhere is None and min(seen_by_way) < MIN_OTHER_WAY * max(seen_by_way):
            # Lines along a motion are where they were, and outvote those that it moved out of reach.
            elsewhere = find_motion(self.patches, self.across, picture)
            if elsewhere is not None and self._is_motion(elsewhere - view.q):
                other, other_seen_by_way = self._measure(picture, self._view(picture, elsewhere))
                if other is not None and sum(other_seen_by_way) > sum(seen_by_way):
                    return other
        return sample

    @property
    def min_seen(self) -> float:
        """How many places must be seen for a measurement."""
        return max(MIN_SEEN, MIN_SEEN_SHARE * len(self.across))

    def _is_dark(self, picture: Pixels) -> bool:
        level = np.mean(self.patches.seen_now(picture, np.zeros((1, 2))))
        return bool(level < min(DARK_LEVEL, DARK_SHARE * self.level))

    def _nearby_view(self, picture: Pixels, before: MotionSample | None) -> "_View":
        """View the lines where they were, or where they were last: a camera that was knocked is likely to lie so."""
        motions = [np.zeros(4)]
        if before is not None and before.motion is not None and self._is_motion(before.motion.q):
            motions.append(before.motion.q)
        return max((self._view(picture, q) for q in motions), key=lambda view: view.count)

    def _better_view(self, picture: Pixels, view: "_View", elsewhere: Array | None) -> "_View":
        """View the lines in another focus, or after that motion, if clearly more of them are seen then."""
        others = [self._view(picture, np.zeros(4), softer_px) for softer_px in OTHER_FOCUS_PX]
        others += [] if elsewhere is None else [self._view(picture, elsewhere)]
        other = max(others, key=lambda one: one.count)
        return other if other.count > MIN_TIMES_MORE * max(view.count, MIN_SEEN) else view

    def _view(self, picture: Pixels, q: Array, softer_px: float = 0.0) -> "_View":
        shifts = self.samples.flow.shifts(self.patches.places, q)
        rows = self.patches.seen_now(picture, np.nan_to_num(shifts))
        return _View(q, rows, self.patches.offsets(rows, softer_px))

    def _measure(
        self,
        picture: Pixels,
        view: "_View",
    ) -> tuple[MotionSample | None, tuple[float, float]]:
        """Return the sample, None where too few places agree, and the share that agrees of lines either way."""
        for _ in range(MAX_STEPS):
            found = view.offsets.seen
            if view.count < self.min_seen:
                return None, (0.0, 0.0)
            softer_px = self.patches.softness(view.rows, found)
            motion = estimate_motion(
                self.across[found], view.offsets.px[found], view.offsets.sigma_px[found]
            ).compose(view.q)
            if not self._is_motion(motion.q - view.q):
                break
            view = self._view(picture, motion.q, softer_px)
        count = int(motion.agreeing.sum())
        if count < self.min_seen:
            return None, (0.0, 0.0)
        kind: Kind = "soft" if abs(softer_px) >= MIN_SOFTER_PX else "seen"
        agreeing = found.copy()
        agreeing[found] = motion.agreeing
        sample = MotionSample(
            kind,
            count,
            self.samples.measure(motion),
            motion,
            motion.sure,
            softer_px,
            self.patches.places[agreeing],
            self._shifts(motion.q, view)[agreeing],
        )
        return sample, self._shares_by_way(agreeing)

    def _shifts(self, q: Array, view: "_View") -> Points:
        """Return how far each place moved (n, 2) px: by q, and across its line as far as it was measured."""
        flow, places, normals = self.samples.flow, self.patches.places, self.patches.normals
        fitted = flow.shifts(places, q)
        beyond_px = np.sum((flow.shifts(places, view.q) - fitted) * normals, axis=1)
        return fitted + (beyond_px + view.offsets.px)[:, None] * normals

    def displacements_mm(self, sample: MotionSample) -> Array:
        """Return how far each place of a sample has moved on the carpet, (n,) mm; NaN out of the model's reach."""
        model = self.samples.flow.model
        before, after = (
            field_from_raw(model, places)
            for places in (sample.places, sample.places + sample.shifts)
        )
        return np.linalg.norm(after - before, axis=1)

    def _shares_by_way(self, places: Mask) -> tuple[float, float]:
        """Return the share of these places of lines that run up and down the picture, and of those across it."""
        is_upright = np.abs(self.patches.normals[:, 0]) > np.abs(self.patches.normals[:, 1])
        of_all = float(places.mean())
        upright, level = (
            float(places[way].mean()) if way.sum() >= MIN_PLACES_ONE_WAY else of_all
            for way in (is_upright, ~is_upright)
        )
        return upright, level

    def _unmeasured(self, picture: Pixels, view: "_View") -> MotionSample:
        """Tell covered lines from lines that are gone."""
        here = self._view(picture, np.zeros(4))
        off_px = np.abs(here.offsets.px[here.offsets.seen])
        if len(off_px) >= MIN_SEEN and np.mean(off_px < STILL_PX) > MAX_STILL_SHARE:
            return MotionSample("covered", view.count)  # few, but all where they were
        with np.errstate(invalid="ignore"):  # a picture of one colour is like nothing
            likeness = float(np.corrcoef(_thumbnail(picture).ravel(), self.thumbnail.ravel())[0, 1])
        bare_share = float(self.patches.bare(here.rows).mean())
        is_covered = likeness > MIN_LIKENESS and bare_share < MAX_BARE_SHARE
        return MotionSample("covered" if is_covered else "gone", view.count)

    def _is_motion(self, q: Array) -> bool:
        """Return whether q moves the region by more than a look from the unmoved places can bear."""
        return float(np.percentile(np.linalg.norm(self.samples.linear @ q, axis=1), 95)) > STILL_PX


@dataclass(frozen=True, eq=False)
class _View:
    """Brightness (n, k) across each place after a motion q (4,), and how far its line lies beside it."""

    q: Array
    rows: Array
    offsets: LineShifts

    @property
    def count(self) -> int:
        return int(self.offsets.seen.sum())


def _find_lines(gray: Pixels, model: CameraModel, field: Field, size: ImageSize) -> LineSamples:
    """Find the lines that are seen near where the model expects them."""
    expected = expected_lines(
        model, fine_pattern(field), size, MAX_PLACES, MIN_APART_PX, MIN_CLEAR_PX
    )
    reach_px = float(np.clip(MAX_MODEL_ERROR * size.width, *MODEL_ERROR_PX))
    lines, _ = lines_in(gray, expected.of(expected.clear), reach_px)
    margin_px = lines.width_px / 2 + MIN_CLEAR_PX
    return lines.of(inside_picture(lines.places, size, margin_px[:, None]))


def _thumbnail(picture: Pixels) -> Array:
    return opencv.to_grey(opencv.shrink_to_width(picture, THUMBNAIL_PX)).astype(np.float64)


def find_motion(patches: LinePatches, across: Array, picture: Pixels) -> Array | None:
    """Search for the motion q (4,) that finds most lines again, to a pixel or so; None where none does.

    For every distance across its line, each place has a likeness to what was seen there before. A shift of the whole
    picture moves each place by what it is across the line: the shift on which most places agree is where it went.

    across (n, 4): n · B of each place; see fitting.image_motion.
    """
    reach = int(np.clip(SEARCH_SHARE * picture.shape[1], MIN_SEARCH_PX, MAX_SEARCH_PX))
    likeness = _likeness(patches, picture, reach)
    best_nearby = np.max(
        [
            np.roll(likeness, by, axis=1)
            for by in range(-MAX_DISAGREEMENT_PX, MAX_DISAGREEMENT_PX + 1)
        ],
        axis=0,
    )
    steps = np.arange(-reach, reach + 1, SHIFT_STEP_PX)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)  # (m, 2) px
    off = np.rint(shifts @ patches.normals.T).astype(int)  # (m, n)
    is_within = np.abs(off) <= reach
    by_shift = best_nearby[np.arange(len(best_nearby)), np.clip(off, -reach, reach) + reach]
    score = np.where(is_within, by_shift, 0.0).sum(axis=1)
    best_off = shifts[int(np.argmax(score))] @ patches.normals.T  # (n,)
    # The picture also turns: near what the shift gives, each place says itself how far its line is.
    distances = np.arange(-reach, reach + 1)
    near_shift = np.where(np.abs(distances - best_off[:, None]) <= NEAR_SHIFT_PX, likeness, 0.0)
    found = near_shift.max(axis=1) > 0
    if found.sum() < MIN_PLACES_FOUND:
        return None
    own_off = distances[near_shift.argmax(axis=1)].astype(float)
    return estimate_motion(
        across[found], own_off[found], np.full(int(found.sum()), SEARCH_SIGMA_PX)
    ).q


def _likeness(patches: LinePatches, picture: Pixels, reach: int) -> Array:
    """Return (n, 2 reach + 1) how well what was seen correlates with what is there now, a pixel apart; 0 if hardly.

    The weighted correlation of T, as it was seen, with g, as it is now, at each distance:

        Σ w (T - T̄) g / √(Σ w (g - ḡ)² · Σ w (T - T̄)²)
    """
    is_whole = patches.away % 1 == 0  # of the rows' distances, some are between pixels
    then, weight = patches.rows[:, is_whole], patches.weight[:, is_whole]
    half = (then.shape[1] - 1) // 2
    distances = np.arange(-reach - half, reach + half + 1).astype(float)
    now = brightness_across(picture, patches.places, patches.normals, distances)
    # (n, 2 reach + 1, k)
    windows = np.lib.stride_tricks.sliding_window_view(now, then.shape[1], axis=1)
    total = weight.sum(axis=1)
    mean = np.einsum("nsk,nk->ns", windows, weight) / total[:, None]
    then = then - (then * weight).sum(axis=1, keepdims=True) / total[:, None]
    product = np.einsum("nsk,nk->ns", windows, then * weight)
    square_now = np.einsum("nsk,nsk,nk->ns", windows, windows, weight) - mean**2 * total[:, None]
    square_then = np.sum(then**2 * weight, axis=1)[:, None]
    likeness = product / np.sqrt(np.maximum(square_now, 1e-6) * np.maximum(square_then, 1e-9))
    is_strong = square_now > MIN_STRENGTH * square_then
    return np.where(is_strong & (likeness > MIN_CORRELATION), likeness, 0.0)
