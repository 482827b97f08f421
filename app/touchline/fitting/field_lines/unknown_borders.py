"""The borders of a field that is not known, and the camera above it: four long lines that enclose what the lines show.

Of all quadrilaterals of lines, the borders are those that are painted along all four sides, and within which the lines
are the same on both sides of both axes, as they are on every field. Half of a field or an area of it encloses less.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.field import Field, Line, Region
from touchline.core.geometry import Array, Mask, Points, homogeneous, inside_picture
from touchline.fitting.field_lines.four_lines import FOCALS, MAX_COSINE, sides_by_focal
from touchline.fitting.field_lines.refinement import initial_camera, refine_camera
from touchline.fitting.field_lines.score import harmonic_mean, project
from touchline.fitting.field_lines.seen_lines import SeenLines
from touchline.fitting.field_pattern import FieldPattern
from touchline.fitting.ray_camera.parameters import RayCameraParameters

LENGTH_MM = 6000.0  # of a field of unknown size
LINE_MM = 20.0  # of its lines
MAX_RATIO = 3.0  # of length to width
USUAL_FOCAL, FOCAL_SPREAD = 1.8, 0.7  # half diagonals, and of its logarithm: where the borders tell nothing
ANGLE_SIGMA, RATIO_SIGMA = 0.02, 0.02  # of a right angle's cosine, and of the ratio
PLACES = 40  # along a side
MIN_PAINTED, MIN_IN_PICTURE = 0.5, 0.6  # of each side: goals interrupt it, and robots
BEYOND, FEW = 0.15, 8  # of a side, past its end, and places there
MAX_GOING_ON = 1  # of eight ends: by chance
MAX_COMPARED, TRIED = 300, 3  # quadrilaterals
POINTS = 600  # on lines, of which it is seen whether they are on both halves
BORDER = 0.98  # of the size: what lies within that is inside
STEPS = 60  # samples along a line as long as the field


@dataclass(frozen=True, eq=False)
class Borders:
    """plane_from_field (3, 3): from a field of unit sides about its centre to the undistorted plane.

    ratio: of its length to its width, as far as four lines tell it.
    """

    plane_from_field: Array
    ratio: float

    def camera(self, seen: SeenLines, ratio: float) -> RayCameraParameters | None:
        """Return the camera over a field of that ratio, LENGTH_MM long; None where it does not lead to the borders."""
        focal, *_ = _focals(self.plane_from_field[None], np.array([ratio]))
        start = initial_camera(self.plane_from_field @ np.diag([1 / LENGTH_MM, ratio / LENGTH_MM, 1.0]),
                               float(focal[0]), seen.plane, seen.size)
        pattern = FieldPattern.of(bare_field(ratio), LENGTH_MM / STEPS)
        refined = None if start is None else refine_camera(start, pattern, seen)
        return None if refined is None else refined.state


def bare_field(ratio: float) -> Field:
    """Return a field of that ratio, LENGTH_MM long, that has its borders alone."""
    x, y = LENGTH_MM / 2, LENGTH_MM / 2 / ratio
    lines = {name: Line(name, start, end, LINE_MM) for name, start, end in (
        ("touch-line-top", (-x, y), (x, y)), ("touch-line-bottom", (-x, -y), (x, -y)),
        ("goal-line-left", (-x, -y), (-x, y)), ("goal-line-right", (x, -y), (x, y)))}
    return Field("", "", 2 * x, 2 * y, lines, {}, {}, {"full": Region("full", (-x, x), (-y, y))})


def find_borders(seen: SeenLines) -> Sequence[Borders]:
    """Return the likeliest borders, the best first; none where no four lines can be those of a field."""
    maps = seen.quadrilaterals
    if not len(maps):
        return ()
    _, ratio, cosine = _focals(maps)
    possible = (cosine < MAX_COSINE) & (ratio >= 1) & (ratio < MAX_RATIO)
    maps, ratio = maps[possible] @ _centred(maps[possible]), ratio[possible]
    painted, drawn, is_border = _sides(maps, seen)
    order = np.flatnonzero(is_border)[np.argsort(-painted[is_border], kind="stable")][:MAX_COMPARED]
    if not len(order):
        return ()
    alike, inside = np.transpose([_inside(maps[index], seen) for index in order])
    enclosed = painted[order] + alike
    value = harmonic_mean(enclosed / (drawn[order] + inside), enclosed / enclosed.max())
    best = np.argsort(-value, kind="stable")[:TRIED]
    return tuple(Borders(maps[index], float(ratio[index])) for index in order[best])


def _focals(maps: Array, given_ratio: Array | None = None) -> tuple[Array, Array, Array]:
    """Return (n,) focal lengths in half diagonals under which maps (n, 3, 3) show a right angle as one, and a ratio.

    Beside them the ratio of the sides, and the cosine that is left of the angle; see four_lines.py. Where the lines do
    not tell a focal length, it is a usual one.
    """
    ratio, cosine = sides_by_focal(maps)
    cost = (cosine / ANGLE_SIGMA) ** 2 + (np.log(FOCALS / USUAL_FOCAL) / FOCAL_SPREAD) ** 2
    if given_ratio is not None:
        cost = cost + (np.log(ratio / given_ratio[:, None]) / RATIO_SIGMA) ** 2
    best = cost.argmin(axis=1)
    row = np.arange(len(maps))
    return FOCALS[best], ratio[row, best], np.abs(cosine[row, best])


def _centred(maps: Array) -> Array:
    """Return (n, 3, 3) from unit sides about the centre to the unit square, y against the picture's from above."""
    up = -np.sign(np.linalg.det(maps))
    result = np.tile(np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]]), (len(maps), 1, 1))
    result[:, 1, 1] = up
    return result


def _sides(maps: Array, seen: SeenLines) -> tuple[Array, Array, Mask]:
    """Return (n,) each: the length of the sides that is painted, that is in the picture, and whether they are borders.

    Borders are painted on all four sides, and end at the corners: what goes on there is of something larger.
    """
    at = (np.arange(PLACES) + 0.5) / PLACES - 0.5
    painted, drawn, shown = (each.reshape(len(maps), 4, PLACES).sum(axis=2) for each in _painted(maps, at, seen))
    is_border = (painted > MIN_PAINTED * drawn).all(axis=1) & (shown > MIN_IN_PICTURE * PLACES).all(axis=1)
    beyond = 0.5 + BEYOND * (np.arange(FEW) + 0.5) / FEW
    going_on = np.zeros(len(maps), int)
    for way in (1, -1):
        further, length, _ = (each.reshape(len(maps), 4, FEW).sum(axis=2)
                              for each in _painted(maps, way * beyond, seen))
        going_on += (further > MIN_PAINTED * np.maximum(length, 1e-9)).sum(axis=1)
    return painted.sum(axis=1), drawn.sum(axis=1), is_border & (going_on <= MAX_GOING_ON)


def _painted(maps: Array, at: Array, seen: SeenLines) -> tuple[Array, Array, Mask]:
    """Return (n, 4 k) each of places so far along the sides (k,): px painted, px in the picture, and whether it is."""
    half, one, nothing = np.full(len(at), 0.5), np.ones(len(at)), np.zeros(len(at))
    places = np.concatenate([np.column_stack(side) for side in ((at, half), (at, -half), (half, at), (-half, at))])
    along = np.concatenate([np.column_stack(way) for way in 2 * [(one, nothing)] + 2 * [(nothing, one)]])
    raw = project(maps, places, seen.plane)
    ahead = project(maps, places + along * (0.25 / PLACES), seen.plane) - raw
    inside = inside_picture(raw, seen.size, 2) & np.isfinite(ahead).all(axis=-1)
    step = np.where(inside, 4 * np.linalg.norm(ahead, axis=-1), 0.0)
    found = seen.ridges.found(np.where(inside[..., None], raw, -1.0), np.where(inside[..., None], ahead, 1.0))
    return step * found, step, inside


def _inside(plane_from_field: Array, seen: SeenLines) -> tuple[float, float]:
    """Return the length of lines within the borders that are on both sides of both axes, and of all of them, px."""
    points, along = seen.some(POINTS)
    field_from_plane = np.asarray(np.linalg.inv(plane_from_field), np.float64)
    at, ahead = (_mapped(field_from_plane, seen.plane.undistorted_from_raw(of))
                 for of in (points, points + 2 * along))
    here = (np.abs(at) < BORDER / 2).all(axis=1) & np.isfinite(ahead).all(axis=1)
    both = np.ones(int(here.sum()))
    for mirror in ((-1, 1), (1, -1)):
        raw, beyond = (project(plane_from_field[None], of[here] * mirror, seen.plane)[0] for of in (at, ahead))
        fine = np.isfinite(raw).all(axis=1) & np.isfinite(beyond).all(axis=1)
        both = np.minimum(both, seen.ridges.found(np.where(fine[:, None], raw, -1.0),
                                                  np.where(fine[:, None], beyond - raw, 1.0)))
    px = seen.ridges.length_px / len(points)
    return float(both.sum() * px), float(here.sum() * px)


def _mapped(matrix: Array, points: Points) -> Points:
    mapped = homogeneous(points) @ matrix.T
    with np.errstate(all="ignore"):
        return np.asarray(mapped[:, :2] / mapped[:, 2:])
