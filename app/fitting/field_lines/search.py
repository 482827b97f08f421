"""From ridges to cameras: lens first, then lines, then which line is which, then the best few drawn onto the ridges."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from annotated_types import Interval

from app.core.field import Field, Region
from app.core.geometry import Array, ImageSize, Mask, Points, inside_picture, with_z
from app.core.progress import Progress, no_progress
from app.fitting.field_lines.blind_distortion import UndistortedPlane, estimate_bend
from app.fitting.field_lines.four_lines import Hypotheses, four_line_hypotheses
from app.fitting.field_lines.line_merging import merge_chains
from app.fitting.field_lines.pattern import FieldPattern, is_half_turn_symmetric, levels
from app.fitting.field_lines.refinement import RefinedCamera, initial_camera, refine_camera
from app.fitting.field_lines.score import RidgeMaps, project, score
from app.fitting.field_lines.three_lines import three_line_hypotheses
from app.fitting.ray_camera.parameters import RayCameraParameters

MAX_LINES = 16
COARSE_STEPS, FINE_STEPS = 12, 60  # samples along a line as long as the field
MAX_FINE = 400  # of the coarsely scored
REFINED = 4
REFINED_POOR = 10  # where none explains the picture
MIN_SEPARATION = 0.02  # of the picture's width, between the region's corners: less is the same camera
MIN_RELATIVE_SCORE = 0.72  # of the best score: what is further behind is not refined
POOR_SCORE = 0.80  # below it, three lines are tried too
ALIKE = 1.4  # how much further off the lines a camera may be at a known height: paint may cost a fifth, a false height
# costs three quarters and more
MIN_REGION_SEEN = 0.35  # of the region's carpet must lie in the picture
MIN_REGION_FILL = 0.06  # of the picture


@dataclass(frozen=True)
class PosePrior:
    """A rough prior of the camera: the height within a third either way, turn_deg within 50°.

    turn_deg: of the region in the picture, clockwise from how it stands when corrected.
    """

    height_mm: Annotated[float, Interval(ge=100, le=100_000)] | None = None
    turn_deg: Annotated[float, Interval(ge=-360, le=360)] | None = None

    def allows(self, height_mm: float, turn_deg: float) -> bool:
        near = self.height_mm is None or 0.7 < height_mm / self.height_mm < 1.4
        off = 0.0 if self.turn_deg is None else abs((turn_deg - self.turn_deg + 180) % 360 - 180)
        return near and off <= 50


@dataclass(frozen=True, eq=False)
class CameraCandidate:
    """A camera whose field lies on ridges. found, explained: shares, see score.py; turn_deg as in PosePrior."""

    refined: RefinedCamera
    found: float
    explained: float
    turn_deg: float
    region_seen: float

    @property
    def value(self) -> float:
        return 2 * self.found * self.explained / max(self.found + self.explained, 1e-9)


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The candidates, best first, and the lines that they were made from."""

    candidates: tuple[CameraCandidate, ...] = ()
    lines: tuple[Array, ...] = ()


def search(chains: Sequence[Points], along: Sequence[Array], field: Field, region: Region, size: ImageSize,
           prior: PosePrior = PosePrior(), progress: Progress = no_progress) -> SearchResult:
    """Search for cameras. chains: points (n, 2) raw px along each ridge, longest first; along: unit vectors at them."""
    plane = UndistortedPlane.of(size, estimate_bend(chains, size))
    lines = merge_chains(chains, plane, MAX_LINES)
    if not chains:
        return SearchResult()
    points, directions = np.concatenate(list(chains)), np.concatenate(list(along))
    ridges = RidgeMaps.of(points, directions, size)
    fine = FieldPattern.of(field, field.length_mm / FINE_STEPS)
    upright = is_half_turn_symmetric(field) and np.allclose([sum(region.x_mm), sum(region.y_mm)], 0) and (
        prior.turn_deg is None)
    scorer = _Scorer(field, region, size, plane, ridges, fine, upright)
    level_x, level_y = levels(field, region)
    progress(0.2, "Matching the lines")
    best = scorer.best(four_line_hypotheses(lines, level_x, level_y))
    if not best or best[0][0] < POOR_SCORE:
        progress(0.4, "Matching three lines and the arcs")
        best = sorted([*best, *scorer.best(three_line_hypotheses(lines, level_x, level_y))], key=lambda b: -b[0])

    def drawn_from(start: RayCameraParameters | None) -> CameraCandidate | None:
        drawn = refine_camera(start, fine, points, directions, size) if start is not None else None
        return scorer.candidate(drawn) if drawn is not None else None

    def allowed(candidate: CameraCandidate) -> bool:
        return prior.allows(float(candidate.refined.state.position_mm[2]), candidate.turn_deg)

    candidates: list[CameraCandidate] = []
    distinct = scorer.apart(best, REFINED_POOR if not best or best[0][0] < POOR_SCORE else REFINED)
    for number, (value, homography, focal) in enumerate(distinct):
        if number and value < MIN_RELATIVE_SCORE * best[0][0]:
            break
        progress(0.5 + 0.5 * number / len(distinct), "Fitting the field to the lines")
        start = initial_camera(homography, focal, plane, size)
        if start is None:
            continue
        candidate = drawn_from(start)
        if candidate is not None and not allowed(candidate) and prior.height_mm is not None:
            # from straight above the lines tell no focal length: then it is the one under which it hangs so high
            other = drawn_from(initial_camera(homography, focal * prior.height_mm / start.position_mm[2], plane, size))
            if other is not None and other.refined.rms_px < ALIKE * candidate.refined.rms_px:
                candidate = other
        if candidate is not None and allowed(candidate):
            candidates.append(candidate)
    return SearchResult(tuple(scorer.ranked(candidates)), tuple(lines))


class _Scorer:
    """Scores and sorts cameras for one picture."""

    def __init__(self, field: Field, region: Region, size: ImageSize, plane: UndistortedPlane, ridges: RidgeMaps,
                 fine: FieldPattern, upright: bool) -> None:
        self.region, self.size, self.plane, self.ridges, self.fine = region, size, plane, ridges, fine
        self.coarse = FieldPattern.of(field, field.length_mm / COARSE_STEPS, min_samples=2)
        self.upright = upright
        sides = [region.width_mm, region.height_mm]
        u, v = (np.linspace(0.04, 0.96, 6) * side for side in sides)
        self.carpet = region.field_from_region(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
        self.rightwards = region.field_from_region(np.array([[0.4, 0.5], [0.6, 0.5]]) * sides)
        self.corners = region.field_from_region(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * sides)

    def best(self, given: Hypotheses) -> list[tuple[float, Array, float]]:
        """Return value, homography and focal length of the best: all scored coarsely, the best of those finely."""
        maps, focal = given.homographies, given.focal
        if not len(maps):
            return []
        shows = self._shows_region(maps)
        maps, focal = maps[shows], focal[shows]
        if len(maps) > MAX_FINE:
            prior = score(maps, self.plane, self.coarse, self.ridges)
            top = np.argsort(-prior, kind="stable")[:MAX_FINE]
            maps, focal = maps[top], focal[top]
        value = score(maps, self.plane, self.fine, self.ridges)
        return [(float(value[i]), maps[i], float(focal[i])) for i in np.argsort(-value, kind="stable")]

    def _shows_region(self, maps: Array) -> Mask:
        """Return whether enough of the region is in the picture, large enough, and upright where no more is known."""
        raw = project(maps, self.carpet, self.plane)
        inside = inside_picture(raw, self.size, 0)
        with np.errstate(invalid="ignore"):
            low = np.where(inside[..., None], raw, np.inf).min(axis=1)
            high = np.where(inside[..., None], raw, -np.inf).max(axis=1)
            fills = np.prod(np.maximum(high - low, 0), axis=-1) > MIN_REGION_FILL * self.size.width * self.size.height
            fine = (inside.mean(axis=1) > MIN_REGION_SEEN) & fills
            if self.upright:
                ends = project(maps, self.rightwards, self.plane)
                fine &= ends[:, 1, 0] > ends[:, 0, 0]
        return fine

    def apart(self, best: list[tuple[float, Array, float]], most: int) -> list[tuple[float, Array, float]]:
        """Return the first of those that differ by more than refining would change."""
        distinct: list[tuple[tuple[float, Array, float], Array]] = []
        for one in best[:3 * MAX_FINE]:
            at = project(one[1][None], self.corners, self.plane)[0]
            if not np.isfinite(at).all():
                at = project(one[1][None], self.carpet[[14, 15, 20, 21]], self.plane)[0]
            if all(not np.abs(at - other).max() < MIN_SEPARATION * self.size.width for _, other in distinct):
                distinct.append((one, at))
            if len(distinct) >= most:
                break
        return [one for one, _ in distinct]

    def candidate(self, drawn: RefinedCamera) -> CameraCandidate | None:
        """Score the refined camera once more, by its own lens."""
        state = drawn.state
        flat = with_z(self.fine.points)
        ahead_mm = with_z(self.fine.along * (self.fine.step_mm / 4)[:, None])
        with np.errstate(all="ignore"):
            raw = state.project(flat)
            ahead = state.project(flat + ahead_mm) - raw
            length = np.linalg.norm(ahead, axis=1) * 4
            inside = inside_picture(raw, self.size, 2) & np.isfinite(length)
            region_seen = inside_picture(state.project(with_z(self.carpet)), self.size, 0).mean()
            ends = state.project(with_z(self.rightwards))
        if not inside.any() or region_seen < MIN_REGION_SEEN or not np.isfinite(ends).all():
            return None
        hit = self.ridges.found(raw[inside], ahead[inside]) * length[inside]
        right = ends[1] - ends[0]
        return CameraCandidate(drawn, float(hit.sum() / length[inside].sum()),
                         float(min(hit.sum() / self.ridges.length_px, 1.0)),
                         float(np.degrees(np.arctan2(right[1], right[0]))), float(region_seen))

    def ranked(self, candidates: list[CameraCandidate]) -> list[CameraCandidate]:
        """Sort, best first, without duplicates; of those that score alike, the one that shows the region best."""
        def worth(c: CameraCandidate) -> float:
            return c.value + 0.15 * c.region_seen + 0.02 * float(np.cos(np.radians(c.turn_deg)))
        distinct: list[tuple[CameraCandidate, Array]] = []
        for c in sorted(candidates, key=lambda c: -worth(c)):
            at = c.refined.state.project(with_z(self.carpet))
            if all(not np.nanmax(np.abs(at - other)) < MIN_SEPARATION * self.size.width for _, other in distinct):
                distinct.append((c, at))
        return [c for c, _ in distinct]


def candidate_json(candidate: CameraCandidate) -> dict[str, Any]:
    """Return a candidate as plain JSON."""
    state = candidate.refined.state
    return {"found": candidate.found, "explained": candidate.explained, "turn_deg": candidate.turn_deg,
            "region_seen": candidate.region_seen, "height_mm": float(state.position_mm[2]),
            "position_mm": [float(v) for v in state.position_mm], "focal_px": float(np.exp(state.log_focal)),
            "rms_px": candidate.refined.rms_px}
