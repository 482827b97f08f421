"""Cameras above one field that what a picture shows allows: matched, refined on the lines, and sorted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Self, TypeVar

import numpy as np
from annotated_types import Interval

from touchline.automatic.hypotheses import (
    MIN_CREDIBLE_FOUND,
    Hypotheses,
    Scores,
    count_within,
    four_line_hypotheses,
    harmonic_mean,
    initial_camera,
    project,
    score,
    three_line_hypotheses,
)
from touchline.automatic.refinement import (
    CAPTURE_PX,
    RefinedCamera,
    explained_points,
    outer_mm,
    refine_camera,
)
from touchline.automatic.seen_lines import SeenLines
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, Mask, Points, inside_picture, with_z
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.fitting.field_pattern import FieldPattern, is_half_turn_symmetric, levels
from touchline.fitting.ray_camera.parameters import RayCameraParameters

COARSE_STEPS, FINE_STEPS = 12, 60  # samples along a line as long as the field
EVERY_COARSE = 3  # of the coarse samples every so manieth, at first
MAX_COARSE, MAX_FINE = 1500, 400  # hypotheses scored by all coarse samples, and by the fine ones
MAX_SCORED_POINTS = 300  # on ridges, of which it is seen whether they lie within the border
MAX_EXPLAINED_POINTS = 1200  # on ridges, of which it is seen whether a marking explains them

MAX_REFINED = 4  # cameras
MAX_REFINED_POOR = 10  # likewise, where none explains the picture
MORE_ATTEMPTS = 6  # beyond those: many a match cannot be refined
MIN_RELATIVE_SCORE = 0.72  # of the best score: what is further behind is not refined
MIN_GOOD_SCORE = 0.80  # below it, three lines are tried too
NEAR_CAPTURE_PX = CAPTURE_PX[2:]
# of the picture's width, between places of the field before and after refining
SAME_MATCH, SAME_CAMERA = 0.01, 0.02
# how much further off the lines a camera may be at a known height: paint may cost a fifth, a
MAX_RMS_RATIO = 1.4
# false height costs three quarters and more

MIN_REGION_SEEN = 0.35  # of the region's carpet must lie in the picture
MIN_REGION_FILL = 0.06  # of the picture
MIN_OVERLAP = 0.4  # of an area that nobody chose with all that is seen of the field
MIN_HEIGHT = 0.2  # of half the field's width: nothing below it sees a field from above
CELLS = (8, 6)  # of the carpet, along and across the field: an eighth of it has six
REGION_CELLS = 6  # of a region, along each side
UPRIGHT_WEIGHT, REGION_WEIGHT = 0.02, 0.15  # of a score: of cameras that explain the lines alike

MAX_TURN_OFF_DEG = 50  # of a roughly known rotation
MIN_HEIGHT_RATIO, MAX_HEIGHT_RATIO = 0.7, 1.4  # to a roughly known height
Pixel = tuple[
    Annotated[float, Interval(ge=-1e5, le=1e5)], Annotated[float, Interval(ge=-1e5, le=1e5)]
]


@dataclass(frozen=True)
class PosePrior:
    """A rough prior of the camera: the height within a third either way, turn_deg within 50°.

    turn_deg: of the region in the picture, clockwise from how it stands when corrected. corners, raw px, a few off: its
    top left, top right, bottom right and bottom left one, likewise.
    """

    height_mm: Annotated[float, Interval(ge=100, le=100_000)] | None = None
    turn_deg: Annotated[float, Interval(ge=-360, le=360)] | None = None
    corners: tuple[Pixel, Pixel, Pixel, Pixel] | None = None

    def allows(self, height_mm: float, turn_deg: float) -> bool:
        near = self.height_mm is None or is_near_height(height_mm, self.height_mm)
        return near and self.allows_turn(turn_deg)

    def allows_turn(self, turn_deg: float) -> bool:
        off = 0.0 if self.turn_deg is None else abs((turn_deg - self.turn_deg + 180) % 360 - 180)
        return off <= MAX_TURN_OFF_DEG


NO_PRIOR = PosePrior()


def is_near_height(height_mm: float, given_mm: float) -> bool:
    """Return whether a camera may hang as high as was roughly given."""
    return MIN_HEIGHT_RATIO < height_mm / given_mm < MAX_HEIGHT_RATIO


@dataclass(frozen=True, eq=False)
class CameraCandidate:
    """A camera whose field lies on ridges. turn_deg: as in PosePrior.

    found: the share of the drawn field that is there, found_px its length; explained: the share of the ridges on its
    carpet that are the field's.
    """

    refined: RefinedCamera
    found: float
    explained: float
    turn_deg: float
    region_seen: float
    found_px: float

    @property
    def value(self) -> float:
        return float(harmonic_mean(self.found, self.explained))


@dataclass(frozen=True, eq=False)
class Match:
    """A camera as its homography (3, 3) from field mm to the undistorted plane; scored as CameraCandidate is."""

    homography: Array
    focal: float
    found: float
    explained: float
    found_px: float

    @property
    def value(self) -> float:
        return float(harmonic_mean(self.found, self.explained))


Scored = TypeVar("Scored", Match, CameraCandidate)


@dataclass(frozen=True, eq=False)
class FieldMatcher:
    """Matches what a picture shows with one field, and refines and sorts the cameras that come of it.

    outer_mm: see outer_mm(). levels: of lines that are matched, x and y. cells (n, 2) mm: the carpet; areas (a, n):
    which of it an area has that a camera may be above; least_overlap: of what is seen with one of them. rightwards
    (2, 2) mm: two places, to see how the field is turned; marks (m, 2) mm: places that differ between two cameras.
    is_upright: whether only cameras count that see it right way round. is_either_way: as for four_line_hypotheses().
    """

    seen: SeenLines
    prior: PosePrior
    outer_mm: Array
    coarse: FieldPattern
    fine: FieldPattern
    levels: tuple[Array, Array]
    cells: Points
    areas: Mask
    least_overlap: float
    rightwards: Points
    marks: Points
    is_upright: bool = False
    is_either_way: bool = False

    @classmethod
    def over_region(cls, seen: SeenLines, field: Field, region: Region, prior: PosePrior) -> Self:
        """For cameras above that region, which may see beyond it."""
        sides = [region.width_mm, region.height_mm]
        u, v = (np.linspace(0.04, 0.96, REGION_CELLS) * side for side in sides)
        cells = region.field_from_region(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        is_upright = (
            is_half_turn_symmetric(field)
            and np.allclose([sum(region.x_mm), sum(region.y_mm)], 0)
            and (prior.turn_deg is None)
        )
        return cls(
            seen,
            prior,
            outer_mm(field),
            *_patterns(field),
            levels(field, region),
            cells,
            np.ones((1, len(cells)), bool),
            0.0,
            region.field_from_region(np.array([[0.4, 0.5], [0.6, 0.5]]) * sides),
            region.field_from_region(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * sides),
            is_upright,
        )

    @classmethod
    def over_any(
        cls, seen: SeenLines, field: Field, regions: Sequence[Region], prior: PosePrior
    ) -> Self:
        """For cameras above any of the regions; of one and the same turned by 180°, where lines tell no difference."""
        half = np.array([field.length_mm, field.width_mm]) / 2
        x, y = (
            np.linspace(-0.96, 0.96, count) * side for count, side in zip(CELLS, half, strict=True)
        )
        cells = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        areas = np.array(
            [
                (
                    (cells >= (region.x_mm[0], region.y_mm[0]))
                    & (cells <= (region.x_mm[1], region.y_mm[1]))
                ).all(axis=1)
                for region in regions
            ]
        )
        whole = Region("", (-half[0], half[0]), (-half[1], half[1]))
        return cls(
            seen,
            prior,
            outer_mm(field),
            *_patterns(field),
            levels(field, whole),
            cells,
            areas,
            MIN_OVERLAP,
            half * np.array([[-0.1, 0.0], [0.1, 0.0]]),
            cells,
            is_either_way=is_half_turn_symmetric(field),
        )

    def candidates(self, progress: Progress = no_progress) -> list[CameraCandidate]:
        """Return the cameras that the lines allow, the best first: of four lines, of three where none is convincing."""
        progress(0.2, "Matching the lines")
        found = self.ranked(
            self.refined(self.matches(), MAX_REFINED, subprogress(progress, 0.3, 0.6))
        )
        if not found or found[0].value < MIN_GOOD_SCORE:
            progress(0.6, "Matching three lines and the arcs")
            found = self.ranked(
                found
                + self.refined(
                    self.three_line_matches(), MAX_REFINED_POOR, subprogress(progress, 0.7, 1.0)
                )
            )
        return found

    def matches(self) -> list[Match]:
        """Return the cameras that four lines allow."""
        return self._scored(
            four_line_hypotheses(self.seen.quadrilaterals, *self.levels, self.is_either_way)
        )

    def three_line_matches(self) -> list[Match]:
        """Return the cameras that three lines allow."""
        return self._scored(
            three_line_hypotheses(self.seen.lines, *self.levels, self.is_either_way)
        )

    def _scored(self, hypotheses: Hypotheses) -> list[Match]:
        """Score all coarsely, and the best of those finely; return these."""
        maps, focal = hypotheses.homographies, hypotheses.focal
        if not len(maps):
            return []
        shows = self._shows_area(maps)
        maps, focal = maps[shows], focal[shows]
        for pattern, most in (
            (self.coarse.every(EVERY_COARSE), MAX_COARSE),
            (self.coarse, MAX_FINE),
        ):
            if len(maps) > most:
                scores = self._scores(maps, pattern)
                value = harmonic_mean(scores.found, scores.found_px / max(scores.most_px, 1e-9))
                best = np.argsort(-value, kind="stable")[:most]
                maps, focal = maps[best], focal[best]
        scores = self._scores(maps, self.fine)
        points, _ = self.seen.sampled(MAX_SCORED_POINTS)
        px_per_point = self.seen.ridges.length_px / len(points)
        within_px = count_within(maps, self.outer_mm, self.seen.plane, points) * px_per_point
        unexplained_px = np.maximum(within_px - scores.inner_px, 0)
        explained = scores.found_px / np.maximum(scores.found_px + unexplained_px, 1e-9)
        return [
            Match(homography, *map(float, figures))
            for homography, *figures in zip(
                maps, focal, scores.found, explained, scores.found_px, strict=True
            )
        ]

    def _scores(self, maps: Array, pattern: FieldPattern) -> Scores:
        return score(
            maps,
            self.seen.plane,
            pattern,
            self.seen.ridges,
            np.all(np.abs(pattern.points) < self.outer_mm, axis=1),
        )

    def _shows_area(self, maps: Array) -> Mask:
        """Return whether enough of an area is in the picture, large enough, and upright where no more is known."""
        raw, size = project(maps, self.cells, self.seen.plane), self.seen.size
        inside = inside_picture(raw, size, 0)
        with np.errstate(invalid="ignore"):
            low = np.where(inside[..., None], raw, np.inf).min(axis=1)
            high = np.where(inside[..., None], raw, -np.inf).max(axis=1)
            fills = (
                np.prod(np.maximum(high - low, 0), axis=-1)
                > MIN_REGION_FILL * size.width * size.height
            )
            seen_share, overlap = self._shares(inside)
            is_area = (seen_share > MIN_REGION_SEEN) & (overlap >= self.least_overlap)
            shows = is_area.any(axis=1) & fills
            if self.is_upright:
                ends = project(maps, self.rightwards, self.seen.plane)
                shows &= ends[:, 1, 0] > ends[:, 0, 0]
        return shows

    def _shares(self, inside: Mask) -> tuple[Array, Array]:
        """Return (..., a) how much of each area is seen, and what share of both is common to it and all that is seen.

        inside (..., n): which cells are.
        """
        areas = self.areas.astype(np.float32)
        common, own = inside.astype(np.float32) @ areas.T, areas.sum(axis=1)
        return common / own, common / np.maximum(
            inside.sum(axis=-1, keepdims=True) + own - common, 1
        )

    def refined(
        self, matches: list[Match], most: int, progress: Progress = no_progress
    ) -> list[CameraCandidate]:
        """Refine those of the best matches that differ and come near the best, until so many cameras are found."""
        candidates: list[CameraCandidate] = []
        matches = by_value(compared(matches))
        distinct = [
            match
            for match in self._distinct_matches(matches, most + MORE_ATTEMPTS)
            if match.value >= MIN_RELATIVE_SCORE * matches[0].value
        ]
        for number, match in enumerate(distinct):
            if len(candidates) >= most:
                break
            progress(number / len(distinct), "Fitting the field to the lines")
            candidate = self._refined_match(match)
            if candidate is not None and self._is_allowed(candidate):
                candidates.append(candidate)
        return candidates

    def _refined_match(self, match: Match) -> CameraCandidate | None:
        """Refine a match, at the height that was given where the lines leave that open."""
        start = self._initial_camera(match, match.focal)
        candidate = self._refined_from(start)
        height_mm = self.prior.height_mm
        if start is None or candidate is None or height_mm is None or self._is_allowed(candidate):
            return candidate
        # From straight above the lines tell no focal length: then it is the one under which it hangs so high.
        other = self._refined_from(
            self._initial_camera(match, match.focal * height_mm / start.position_mm[2])
        )
        is_as_good = (
            other is not None and other.refined.rms_px < MAX_RMS_RATIO * candidate.refined.rms_px
        )
        return other if is_as_good else candidate

    def _initial_camera(self, match: Match, focal: float) -> RayCameraParameters | None:
        return initial_camera(match.homography, focal, self.seen.plane, self.seen.size)

    def refined_from_any(self, starts: Sequence[RayCameraParameters]) -> list[CameraCandidate]:
        """Refine cameras that are near the right one, and return the best of them."""
        found = [
            candidate
            for start in starts
            if (candidate := self._refined_from(start)) and self._is_allowed(candidate)
        ]
        return [max(found, key=lambda candidate: candidate.value)] if found else []

    def _is_allowed(self, candidate: CameraCandidate) -> bool:
        return self.prior.allows(float(candidate.refined.state.position_mm[2]), candidate.turn_deg)

    def _refined_from(self, start: RayCameraParameters | None) -> CameraCandidate | None:
        """Refine a camera from near by, where a wall beside a line cannot catch it; from afar where that fails."""
        if start is None:
            return None
        near = self._refined_within(start, NEAR_CAPTURE_PX)
        if near is not None and near.value > MIN_GOOD_SCORE:
            return near
        far = self._refined_within(start, CAPTURE_PX)
        return max(
            (each for each in (near, far) if each is not None),
            key=lambda each: each.value,
            default=None,
        )

    def _refined_within(
        self, start: RayCameraParameters, captures_px: tuple[float, ...]
    ) -> CameraCandidate | None:
        refined = refine_camera(start, self.fine, self.seen, captures_px)
        return self._candidate(refined) if refined is not None else None

    def _distinct_matches(self, matches: list[Match], most: int) -> list[Match]:
        """Return the first of those that differ by more than refining would change."""
        distinct: list[tuple[Match, Points]] = []
        for one in matches[: 3 * MAX_FINE]:
            at = project(one.homography[None], self.marks, self.seen.plane)[0]
            if not np.isfinite(at).all():
                at = project(one.homography[None], self.cells, self.seen.plane)[0]
            if all(not self._are_alike(at, other, SAME_MATCH) for _, other in distinct):
                distinct.append((one, at))
            if len(distinct) >= most:
                break
        return [one for one, _ in distinct]

    def _are_alike(self, at: Points, other: Points, within: float) -> bool:
        """Whether two cameras see all that either has in the picture at the same places, to a share of its width."""
        if at.shape != other.shape:
            return False
        size = self.seen.size
        here = inside_picture(at, size) | inside_picture(other, size)
        return bool(here.any() and np.abs(at - other)[here].max() < within * size.width)

    def _candidate(self, refined: RefinedCamera) -> CameraCandidate | None:
        """Score the refined camera once more, by its own lens; None where it cannot be one above the field."""
        state, size = refined.state, self.seen.size
        flat = with_z(self.fine.points)
        quarter_step_mm = with_z(self.fine.along * (self.fine.step_mm / 4)[:, None])
        with np.errstate(all="ignore"):
            raw = state.project(flat)
            ahead = state.project(flat + quarter_step_mm) - raw
            length_px = np.linalg.norm(ahead, axis=1) * 4
            inside = inside_picture(raw, size, 2) & np.isfinite(length_px)
            seen_share, overlap = self._shares(
                inside_picture(state.project(with_z(self.cells)), size, 0)
            )
            ends = state.project(with_z(self.rightwards))
        shown = int(overlap.argmax())
        is_above = state.position_mm[2] > MIN_HEIGHT * self.outer_mm.min()
        is_shown = seen_share[shown] >= MIN_REGION_SEEN and overlap[shown] >= self.least_overlap
        if not (is_above and is_shown and inside.any() and np.isfinite(ends).all()):
            return None
        found_px = self.seen.ridges.found(raw[inside], ahead[inside]) * length_px[inside]
        right = ends[1] - ends[0]
        explained, unexplained = explained_points(
            state, self.fine, self.outer_mm, *self.seen.sampled(MAX_EXPLAINED_POINTS), size
        )
        return CameraCandidate(
            refined,
            found=float(found_px.sum() / length_px[inside].sum()),
            explained=explained / max(explained + unexplained, 1),
            turn_deg=float(np.degrees(np.arctan2(right[1], right[0]))),
            region_seen=float(seen_share[shown]),
            found_px=float(found_px.sum()),
        )

    def ranked(self, candidates: list[CameraCandidate]) -> list[CameraCandidate]:
        """Sort, best first, without duplicates, each compared with the others."""
        return self.distinct(compared(candidates))

    def distinct(self, candidates: list[CameraCandidate]) -> list[CameraCandidate]:
        """Sort, best first, without duplicates; of those that score alike, the one that shows the region best."""

        def worth(one: CameraCandidate) -> float:
            upright = float(np.cos(np.radians(one.turn_deg)))
            return one.value + REGION_WEIGHT * one.region_seen + UPRIGHT_WEIGHT * upright

        distinct: list[tuple[CameraCandidate, Array]] = []
        for one in sorted(candidates, key=lambda one: -worth(one)):
            at = one.refined.state.project(with_z(self.cells))
            if all(not self._are_alike(at, other, SAME_CAMERA) for _, other in distinct):
                distinct.append((one, at))
        return [one for one, _ in distinct]


def compared(cameras: Sequence[Scored]) -> list[Scored]:
    """Return the same, of which explained also counts what another of them finds and this one does not."""
    most_px = max((one.found_px for one in cameras if one.found > MIN_CREDIBLE_FOUND), default=0.0)
    return [
        replace(one, explained=one.explained * min(one.found_px / most_px, 1.0)) if most_px else one
        for one in cameras
    ]


def by_value(cameras: Sequence[Scored]) -> list[Scored]:
    return sorted(cameras, key=lambda one: -one.value)


def _patterns(field: Field) -> tuple[FieldPattern, FieldPattern]:
    """Return the field sampled coarsely, and finely."""
    return (
        FieldPattern.of(field, field.length_mm / COARSE_STEPS, min_samples=2),
        FieldPattern.of(field, field.length_mm / FINE_STEPS),
    )
