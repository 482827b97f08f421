"""Whether a camera still stands as it did: the field's lines followed at some hundred places, at next to no cost.

    reference = Reference.of(pictures, model, field, region)     once: where the lines are, and what they look like
    sample = reference.look(picture, sample before)              each second: how far the picture has moved

Lines are looked for where the calibration expects them, and followed from where they *were seen*: what the model does
not tell exactly is no drift. Places covered by robots and people disagree with the others and are rejected.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize, Mask, Points, inside_picture
from touchline.evaluate.drift.expected import expected_lines
from touchline.evaluate.drift.orientation import OrientationReference
from touchline.evaluate.drift.search import best_motion
from touchline.fitting.field_pattern import fine_pattern
from touchline.fitting.image_motion import ImageMotion, MotionField, MotionSize, RegionSamples, estimate_motion
from touchline.models import CameraModel
from touchline.vision.patches import LinePatches, LineShifts
from touchline.vision.profiles import across_lines
from touchline.vision.ridges import with_bright_lines

PLACES = 160  # at most are looked for
APART_PX, CLEAR_PX = 6.0, 7.0
CAPTURE = 0.007  # of the picture's width: a model may be off by so much, 9 px of 1280
MIN_PLACES = 12  # that a reference must have, and of which so many must be seen:
MIN_SEEN = 8
SEEN_SHARE = 0.25
MIN_CONTRAST = 8.0  # grey levels
MAX_STEPS = 3
STILL_PX = 0.15  # moved less, a look from the nominal places is as good as from the moved ones
SOFTER_PX = 1.0  # σ: softer than that by a bump, not by the night's cold
DARK_LEVEL = 14.0  # mean grey level about the lines, and
DARK_SHARE = 0.35  # of what it was
THUMB_PX = 32
ALIKE = 0.6  # correlation of the whole picture, very small: the same scene, perhaps with people in the way
GRID = (13, 9)

OTHER_FOCUS = (1.0, 2.0, 4.0, -1.0, -2.0)  # px softer, where hardly anything looks as it did
MORE = 1.5  # times as many places must be seen elsewhere, to believe that
MAX_BARE = 0.4
MAX_STILL = 0.6  # by chance, an eighth of them would be

ONE_WAY = 0.5  # of the share that is seen of lines the other way: with less, they may have moved out of reach
MIN_WAY = 4  # places that tell of lines one way

Kind = Literal["seen", "soft", "covered", "gone", "dark", "turned", "mirrored"]


@dataclass(frozen=True, eq=False)
class DriftSample:
    """One sample. judged: how far the picture moved, None where unknown; sure: in σ; seen: count of lines found.

    softer_px: σ by which lines are softer than they were, negative for sharper.
    """

    kind: Kind
    seen: int
    judged: MotionSize | None = None
    motion: ImageMotion | None = None
    sure: float = 0.0
    softer_px: float = 0.0


@dataclass(frozen=True, eq=False)
class DriftReference:
    """Tracked lines. across (n, 4): n · B. level: mean grey about the lines; thumb: the picture, very small.

    way_round: what tells whether the picture was turned or mirrored, which the lines do not.
    """

    patches: LinePatches
    across: Array
    yardstick: RegionSamples
    level: float
    thumb: NDArray[np.float64]
    size: ImageSize
    way_round: OrientationReference

    @classmethod
    def of(cls, pictures: list[NDArray[np.uint8]], model: CameraModel, field: Field, region: Region,
           ) -> "DriftReference | None":
        """From one picture or several of the same scene; None where too few lines are where they are expected."""
        size = ImageSize(pictures[0].shape[1], pictures[0].shape[0])
        flow = MotionField(model, (size.width, size.height))
        x, y = np.meshgrid(np.linspace(*region.x_mm, GRID[0]), np.linspace(*region.y_mm, GRID[1]))
        measure = RegionSamples.of(flow, np.stack([x.ravel(), y.ravel()], axis=-1))
        found = found_lines(with_bright_lines(pictures[0]), model, field, size)
        if measure is None or found is None:
            return None
        places, normals, width_px = found
        patches = LinePatches.of(pictures, places, normals, width_px)
        over = flow.at(places)
        good = np.isfinite(over).all(axis=(1, 2)) & (patches.contrast > MIN_CONTRAST)
        if good.sum() < MIN_PLACES:
            return None
        patches = LinePatches(places[good], normals[good], patches.away, patches.rows[good], patches.weight[good],
                              patches.contrast[good])
        across = np.einsum("ni,nik->nk", patches.normals, over[good])
        return cls(patches, across, measure, float(patches.rows.mean()), _thumb(pictures[0]), size,
                   OrientationReference.of(pictures[0], model, region))

    def look(self, picture: NDArray[np.uint8], before: DriftSample | None = None) -> DriftSample:
        """Where the lines are now. before: the last sample; a camera that was knocked is likely to lie as it did."""
        guesses = [np.zeros(4)]
        if before is not None and before.motion is not None and self._far(before.motion.q):
            guesses.append(before.motion.q)
        if np.mean(self.patches.seen_now(picture, np.zeros((1, 2)))) < min(DARK_LEVEL, DARK_SHARE * self.level):
            return DriftSample("dark", 0)
        best = max((self._tried(picture, guess) for guess in guesses), key=lambda tried: tried.count)
        elsewhere = None
        if best.count < 2 * self.least:
            others = [self._tried(picture, guesses[0], level) for level in OTHER_FOCUS]
            elsewhere = best_motion(self.patches, self.across, picture)
            others += [] if elsewhere is None else [self._tried(picture, elsewhere)]
            other = max(others, key=lambda tried: tried.count)
            best = other if other.count > MORE * max(best.count, MIN_SEEN) else best
        sample, each_way = self._measured(picture, best)
        if sample is None:
            return self._unseen(picture, best)
        if (way := self.way_round.compare(picture, self.yardstick.flow.model).way) is not None:
            return DriftSample(way, sample.seen)
        if elsewhere is None and min(each_way) < ONE_WAY * max(each_way):
            # Lines along a motion are where they were, and outvote those that it moved out of reach.
            elsewhere = best_motion(self.patches, self.across, picture)
            if elsewhere is not None and self._far(elsewhere - best.q):
                other_sample, other_way = self._measured(picture, self._tried(picture, elsewhere))
                return other_sample if other_sample is not None and sum(other_way) > sum(each_way) else sample
        return sample

    @property
    def least(self) -> float:
        """How many places must be seen for a measurement."""
        return max(MIN_SEEN, SEEN_SHARE * len(self.across))

    def _tried(self, picture: NDArray[np.uint8], q: Array, softer_px: float = 0.0) -> "_Tried":
        shifts = self.yardstick.flow.shifts(self.patches.places, q)
        rows = self.patches.seen_now(picture, np.nan_to_num(shifts))
        return _Tried(q, rows, self.patches.offsets(rows, softer_px))

    def _measured(self, picture: NDArray[np.uint8], tried: "_Tried") -> tuple[DriftSample | None, tuple[float, float]]:
        """Return the sample, None where too few places agree, and the share that agrees of lines either way."""
        for _ in range(MAX_STEPS):
            found = tried.offsets.seen
            if tried.count < self.least:
                return None, (0.0, 0.0)
            softer = self.patches.softness(tried.rows, found)
            motion = estimate_motion(self.across[found], tried.offsets.px[found],
                                     tried.offsets.sigma_px[found]).compose(tried.q)
            if not self._far(motion.q - tried.q):
                break
            tried = self._tried(picture, motion.q, softer)
        count = int(motion.agreeing.sum())
        if count < self.least:
            return None, (0.0, 0.0)
        kind: Kind = "soft" if abs(softer) >= SOFTER_PX else "seen"
        agreeing = found.copy()
        agreeing[found] = motion.agreeing
        return DriftSample(kind, count, self.yardstick.measure(motion), motion, motion.sure, softer), (
            self._shares(agreeing))

    def _shares(self, places: Mask) -> tuple[float, float]:
        """Return the share of these places of lines that run up and down the picture, and of those across it."""
        upright = np.abs(self.patches.normals[:, 0]) > np.abs(self.patches.normals[:, 1])
        every = float(places.mean())
        up, level = (float(places[way].mean()) if way.sum() >= MIN_WAY else every for way in (upright, ~upright))
        return up, level

    def _unseen(self, picture: NDArray[np.uint8], tried: "_Tried") -> DriftSample:
        """Tell covered lines from lines that are gone."""
        here = self._tried(picture, np.zeros(4))
        left = np.abs(here.offsets.px[here.offsets.seen])
        if len(left) >= MIN_SEEN and np.mean(left < STILL_PX) > MAX_STILL:
            return DriftSample("covered", tried.count)  # few, but all where they were
        with np.errstate(invalid="ignore"):  # a picture of one colour is like nothing
            alike = float(np.corrcoef(_thumb(picture).ravel(), self.thumb.ravel())[0, 1])
        bare = float(self.patches.bare(here.rows).mean())
        return DriftSample("covered" if alike > ALIKE and bare < MAX_BARE else "gone", tried.count)

    def _far(self, q: Array) -> bool:
        return float(np.percentile(np.linalg.norm(self.yardstick.linear @ q, axis=1), 95)) > STILL_PX


@dataclass(frozen=True, eq=False)
class _Tried:
    q: Array
    rows: NDArray[np.float64]
    offsets: LineShifts

    @property
    def count(self) -> int:
        return int(self.offsets.seen.sum())


def found_lines(gray: NDArray[np.uint8], model: CameraModel, field: Field, size: ImageSize,
                ) -> tuple[Points, Points, Array] | None:
    """Middles of lines (n, 2) px that are seen near where the model expects them, normals, and widths (n,) px."""
    places = expected_lines(model, fine_pattern(field), size, PLACES, APART_PX, CLEAR_PX)
    if not places.clear.any():
        return None
    some = places.clear
    capture = float(np.clip(CAPTURE * size.width, 3.0, 12.0))
    profiles = across_lines(gray, places.places[some], places.normals[some], places.width_px[some],
                            places.marking[some], capture)
    hits = profiles.found
    middles = places.places[some] + np.where(hits, profiles.middle, 0.0)[:, None] * places.normals[some]
    margin = places.width_px[some] / 2 + CLEAR_PX
    hits = hits & inside_picture(middles, size, margin[:, None])
    return (middles[hits], places.normals[some][hits], places.width_px[some][hits]) if hits.any() else None


def _thumb(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    return opencv.to_grey(opencv.shrink_to_width(picture, THUMB_PX)).astype(np.float64)
