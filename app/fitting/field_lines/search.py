"""From ridges to cameras: lens first, then lines, then which line is which, then the best few drawn onto the ridges."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.field import Field, Region
from app.core.geometry import Array, ImageSize, Points
from app.fitting.field_lines.blind_distortion import Plane, bend_of
from app.fitting.field_lines.hypotheses import Hypotheses, hypotheses
from app.fitting.field_lines.line_merging import SeenLine, seen_lines
from app.fitting.field_lines.pattern import FieldPattern, levels, turns_onto_itself
from app.fitting.field_lines.refinement import Refined, first_state, refined
from app.fitting.field_lines.score import Evidence, projected, scores
from app.fitting.field_lines.three_lines import three_line_hypotheses

MOST_LINES = 16
COARSE_STEPS, FINE_STEPS = 12, 60  # samples along a line as long as the field
KEPT = 400  # of the coarsely scored
REFINED = 4
REFINED_POOR = 10  # where none explains the picture
APART = 0.02  # of the picture's width, between the region's corners: less is the same camera
HOPEFUL = 0.72  # of the best score: what is further behind is not refined
POOR = 0.80  # below it, three lines are tried too
REGION_SEEN = 0.35  # of the region's carpet must lie in the picture
REGION_FILLS = 0.06  # of the picture


@dataclass(frozen=True)
class PosePrior:
    """What somebody knows of the camera: each within a third either way; turn_deg within 50°."""

    height_mm: float | None = None
    turn_deg: float | None = None  # of the region in the picture, clockwise from how it stands when corrected

    def allows(self, height_mm: float, turn_deg: float) -> bool:
        near = self.height_mm is None or 0.7 < height_mm / self.height_mm < 1.4
        off = 0.0 if self.turn_deg is None else abs((turn_deg - self.turn_deg + 180) % 360 - 180)
        return near and off <= 50


@dataclass(frozen=True, eq=False)
class Candidate:
    """A camera that draws the field onto ridges. found, explained: shares, see field_score; turn_deg as in Rough."""

    refined: Refined
    found: float
    explained: float
    turn_deg: float
    region_seen: float

    @property
    def value(self) -> float:
        return 2 * self.found * self.explained / max(self.found + self.explained, 1e-9)


@dataclass(frozen=True, eq=False)
class Searched:
    """What was looked at, and the candidates, best first."""

    candidates: tuple[Candidate, ...]
    lines: tuple[SeenLine, ...]
    plane: Plane
    tried: int


def search(chains: Sequence[Points], along: Sequence[Array], field: Field, region: Region, size: ImageSize,
           rough: PosePrior = PosePrior(), progress: Callable[[float, str], None] = lambda f, w: None) -> Searched:
    """chains: points (n, 2) raw px along each ridge, the longest first; along: unit vectors at them."""
    plane = Plane.of(size, bend_of(chains, size))
    lines = seen_lines(chains, plane, MOST_LINES)
    if not chains:
        return Searched((), (), plane, 0)
    points, directions = np.concatenate(list(chains)), np.concatenate(list(along))
    evidence = Evidence.of(points, directions, size)
    fine = FieldPattern.of(field, field.length_mm / FINE_STEPS)
    upright = turns_onto_itself(field) and np.allclose([sum(region.x_mm), sum(region.y_mm)], 0) and (
        rough.turn_deg is None)
    judge = _Judge(field, region, size, plane, evidence, fine, upright)
    level_x, level_y = levels(field, region)
    progress(0.2, "Trying which line is which")
    best = judge.best(hypotheses(lines, level_x, level_y))
    tried = judge.tried
    if not best or best[0][0] < POOR:
        progress(0.4, "Trying three lines and the arcs")
        best = sorted([*best, *judge.best(three_line_hypotheses(lines, level_x, level_y))], key=lambda b: -b[0])
        tried = judge.tried
    candidates: list[Candidate] = []
    distinct = judge.apart(best, REFINED_POOR if not best or best[0][0] < POOR else REFINED)
    for number, (value, homography, focal) in enumerate(distinct):
        if number and value < HOPEFUL * best[0][0]:
            break
        progress(0.5 + 0.5 * number / len(distinct), "Drawing the field onto the lines")
        start = first_state(homography, focal, plane, size)
        drawn = refined(start, fine, points, directions, size) if start is not None else None
        candidate = judge.candidate(drawn) if drawn is not None else None
        if candidate is not None and rough.allows(float(candidate.refined.state.position_mm[2]), candidate.turn_deg):
            candidates.append(candidate)
    return Searched(tuple(judge.ranked(candidates)), tuple(lines), plane, tried)


class _Judge:
    """Scores and sorts cameras for one picture."""

    def __init__(self, field: Field, region: Region, size: ImageSize, plane: Plane, evidence: Evidence,
                 fine: FieldPattern, upright: bool) -> None:
        self.region, self.size, self.plane, self.evidence, self.fine = region, size, plane, evidence, fine
        self.coarse = FieldPattern.of(field, field.length_mm / COARSE_STEPS, least=2)
        self.upright, self.tried = upright, 0
        u, v = (np.linspace(0.04, 0.96, 6) * side for side in (region.width_mm, region.height_mm))
        grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        self.carpet = region.field_from_region(grid)
        ends = np.array([[0.4, 0.5], [0.6, 0.5]]) * [region.width_mm, region.height_mm]
        self.rightwards = region.field_from_region(ends)
        corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [region.width_mm, region.height_mm]
        self.corners = region.field_from_region(corners)

    def best(self, given: Hypotheses) -> list[tuple[float, Array, float]]:
        """The best of them: value, homography, focal length; all coarsely, the hopeful finely."""
        maps, focal = given.homographies, given.focal
        self.tried += len(maps)
        if not len(maps):
            return []
        shows = self._shows_region(maps)
        maps, focal = maps[shows], focal[shows]
        if len(maps) > KEPT:
            rough = scores(maps, self.plane, self.coarse, self.evidence).value
            top = np.argsort(-rough, kind="stable")[:KEPT]
            maps, focal = maps[top], focal[top]
        value = scores(maps, self.plane, self.fine, self.evidence).value
        return [(float(value[i]), maps[i], float(focal[i])) for i in np.argsort(-value, kind="stable")]

    def _shows_region(self, maps: Array) -> Array:
        """Whether enough of the region is in the picture, large enough, and upright where no more is known."""
        raw = projected(maps, self.carpet, self.plane)
        with np.errstate(invalid="ignore"):
            inside = ((raw >= 0) & (raw <= np.array(tuple(self.size)) - 1)).all(axis=-1)
            low = np.where(inside[..., None], raw, np.inf).min(axis=1)
            high = np.where(inside[..., None], raw, -np.inf).max(axis=1)
            fills = np.prod(np.maximum(high - low, 0), axis=-1) > REGION_FILLS * self.size.width * self.size.height
            fine = (inside.mean(axis=1) > REGION_SEEN) & fills
            if self.upright:
                ends = projected(maps, self.rightwards, self.plane)
                fine &= ends[:, 1, 0] > ends[:, 0, 0]
        return fine

    def apart(self, best: list[tuple[float, Array, float]], most: int) -> list[tuple[float, Array, float]]:
        """The first of those that differ by more than what refining evens out."""
        kept: list[tuple[tuple[float, Array, float], Array]] = []
        for one in best[:3 * KEPT]:
            at = projected(one[1][None], self.corners, self.plane)[0]
            if not np.isfinite(at).all():
                at = projected(one[1][None], self.carpet[[14, 15, 20, 21]], self.plane)[0]
            if all(not np.abs(at - other).max() < APART * self.size.width for _, other in kept):
                kept.append((one, at))
            if len(kept) >= most:
                break
        return [one for one, _ in kept]

    def candidate(self, drawn: Refined) -> Candidate | None:
        """The refined camera judged once more, by its own lens."""
        state = drawn.state
        flat = np.concatenate([self.fine.points, np.zeros((len(self.fine.points), 1))], axis=1)
        ahead_mm = np.concatenate([self.fine.along * (self.fine.step_mm / 4)[:, None],
                                   np.zeros((len(flat), 1))], axis=1)
        with np.errstate(all="ignore"):
            raw = state.project(flat)
            ahead = state.project(flat + ahead_mm) - raw
            length = np.linalg.norm(ahead, axis=1) * 4
            inside = ((raw >= 2) & (raw <= np.array(tuple(self.size)) - 3)).all(axis=1) & np.isfinite(length)
            carpet = state.project(np.concatenate([self.carpet, np.zeros((len(self.carpet), 1))], axis=1))
            seen = ((carpet >= 0) & (carpet <= np.array(tuple(self.size)) - 1)).all(axis=1).mean()
            ends = state.project(np.concatenate([self.rightwards, np.zeros((2, 1))], axis=1))
        if not inside.any() or seen < REGION_SEEN or not np.isfinite(ends).all():
            return None
        hit = self.evidence.found(raw[inside], ahead[inside]) * length[inside]
        right = ends[1] - ends[0]
        return Candidate(drawn, float(hit.sum() / length[inside].sum()),
                         float(min(hit.sum() / self.evidence.length_px, 1.0)),
                         float(np.degrees(np.arctan2(right[1], right[0]))), float(seen))

    def ranked(self, candidates: list[Candidate]) -> list[Candidate]:
        """Best first, no camera twice; of those that explain the picture alike, the one that shows the region best."""
        def worth(c: Candidate) -> float:
            return c.value + 0.05 * c.region_seen + 0.02 * float(np.cos(np.radians(c.turn_deg)))
        kept: list[tuple[Candidate, Array]] = []
        for c in sorted(candidates, key=lambda c: -worth(c)):
            at = c.refined.state.project(np.concatenate([self.carpet, np.zeros((len(self.carpet), 1))], axis=1))
            if all(not np.nanmax(np.abs(at - other)) < APART * self.size.width for _, other in kept):
                kept.append((c, at))
        return [c for c, _ in kept]


def described(candidate: Candidate) -> dict[str, Any]:
    """What is told of a candidate."""
    state = candidate.refined.state
    return {"found": candidate.found, "explained": candidate.explained, "turn_deg": candidate.turn_deg,
            "region_seen": candidate.region_seen, "height_mm": float(state.position_mm[2]),
            "position_mm": [float(v) for v in state.position_mm], "focal_px": float(np.exp(state.log_focal)),
            "rms_px": candidate.refined.rms_px}
