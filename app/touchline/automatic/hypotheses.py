"""Cameras that what is seen allows, many at once: from four lines, three lines or four corners; and their scores.

Four lines, two across two others, are matched with two pairs of field lines and give a homography. It splits into one
from the unit square to the seen quadrilateral and a scaling of the field's rectangle to that square, so its columns,
and with them all that tells a possible camera, are known before any pair of levels is tried: a camera with square
pixels and its axis in the picture's middle sees a right angle as one,

    x₁x₂ + y₁y₂ + p z₁z₂ = 0,    p = (focal length / unit)²,

and shows the rectangle's sides in the ratio of the columns' lengths under the same p. Few rectangles have that ratio.

Three lines, two of them parallel on the carpet, do for a given focal length: with it, a line in the picture is a plane
through the camera. The two parallels' planes meet in their direction d₁; the third line runs square to it, along
d₂ = n₃ × d₁. How far the parallels are apart on the field gives the scale, so that a square drawn between them has its
four corners in the picture: a quadrilateral like any other.

Four corners, as an operator or a program gives them, a few pixels off, give a homography, and it the focal length, but
nothing of the lens: cameras are made for a series of bends, each of which straightens the picture its own way. What
they come to is decided on the lines.

Of each camera, the field's samples are projected through the roughly known bend. A sample in the picture finds its
ridge if one runs the same way near by. Found over expected length says whether the drawing is there, found over seen
length whether it is all that is there; the matching ranks a camera by the harmonic mean of both.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.automatic.seen_lines import RidgeMaps, UndistortedPlane, parallel_pairs, square_maps
from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import Region
from touchline.core.geometry import (
    Array,
    ImageSize,
    Indices,
    Mask,
    Points,
    homogeneous,
    inside_picture,
)
from touchline.core.statements import say
from touchline.fitting.field_pattern import FieldPattern
from touchline.fitting.linear import pose_from_homography
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models.ray_camera import Division

FOCALS = np.geomspace(0.45, 14.0, 18)  # half diagonals, under which quadrilaterals are looked at
MAX_COSINE = 0.10  # cosine of what a right angle may come to: lens and centre are known roughly
MAX_RATIO_ERROR = 0.10  # of a side's length, likewise
MAX_HYPOTHESES = 60_000

THREE_LINE_FOCALS = np.geomspace(0.55, 9.0, 18)  # half diagonals
MAX_THREE_LINE_LINES = 5  # the longest, of which three are picked
MIN_CROSSING_DEPTH = 0.05  # of two lines' crossing, homogeneous: nearer 0 they all but run alike
# of the angle from the parallels to the plane through camera and third line: less, and that hardly says
# which direction runs across them
MIN_SINE = 0.5
MIN_RAY_DEPTH = 0.02  # of a corner, for a distance of 1 between the two

CORNER_BENDS = (0.0, -0.15, -0.3, -0.5, -0.75, 0.15)  # from none to a fisheye's, and a pincushion's
# about the area, of how far its corners lie from its middle: a strong barrel's sides bulge
CORNER_MARGIN = 0.15
# half diagonals, where the corners tell no focal length
USUAL_FOCAL, USUAL_FOCAL_WEIGHT = 1.5, 1e-3

MAX_BATCH = 3000  # homographies scored at once, for memory
# of a drawn field that is there: what it finds is the field, or part of it
MIN_CREDIBLE_FOUND = 0.6


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """homographies (n, 3, 3) from field mm to the undistorted plane, depth positive before the camera; focal (n,)."""

    homographies: Array
    focal: Array


NO_HYPOTHESES = Hypotheses(np.empty((0, 3, 3)), np.empty(0))


def four_line_hypotheses(
    quadrilaterals: Array,
    levels_x: Array,
    levels_y: Array,
    is_either_way: bool = False,
) -> Hypotheses:
    """Return every camera that four lines and two pairs of levels allow; the same input gives the same order.

    quadrilaterals: as quadrilaterals() of seen_lines.py has them. is_either_way: of a camera and the same over the
    field turned by 180°, just one.
    """
    pairs_x = np.array(
        [(a, b) for a in levels_x for b in levels_x if a != b and (a < b or not is_either_way)]
    ).reshape(-1, 2)
    pairs_y = np.array([(a, b) for a in levels_y for b in levels_y if a != b]).reshape(-1, 2)
    if not len(quadrilaterals) or not len(pairs_x) or not len(pairs_y):
        return NO_HYPOTHESES
    of_x, of_y = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(len(pairs_x)), np.arange(len(pairs_y)), indexing="ij")
    )
    wide, high = np.ptp(pairs_x[of_x], axis=1), np.ptp(pairs_y[of_y], axis=1)
    sense = np.sign((pairs_x[of_x, 1] - pairs_x[of_x, 0]) * (pairs_y[of_y, 1] - pairs_y[of_y, 0]))
    # Many rectangles have the same ratio: each ratio is judged once.
    ratios, ratio_index = np.unique(np.round(np.log(wide / high), 9), return_inverse=True)
    fits, focal = _fitting_focals(quadrilaterals, ratios)
    # From above, the field's y runs against the picture's: a mirrored match is no view of it.
    is_unmirrored = -np.sign(np.linalg.det(quadrilaterals))[:, None] == sense[None]
    quad, rectangle = np.nonzero(fits[:, ratio_index] & is_unmirrored)
    quad, rectangle = thinned(quad, rectangle)
    square_from_field = np.zeros((len(quad), 3, 3))
    for axis, pair in ((0, pairs_x[of_x[rectangle]]), (1, pairs_y[of_y[rectangle]])):
        side = pair[:, 1] - pair[:, 0]
        square_from_field[:, axis, axis] = 1 / side
        square_from_field[:, axis, 2] = -pair[:, 0] / side
    square_from_field[:, 2, 2] = 1
    return Hypotheses(quadrilaterals[quad] @ square_from_field, focal[quad, ratio_index[rectangle]])


def thinned(*columns: Indices) -> list[Indices]:
    """Return at most MAX_HYPOTHESES rows of columns (n,), evenly spaced."""
    if len(columns[0]) <= MAX_HYPOTHESES:
        return list(columns)
    chosen = np.linspace(0, len(columns[0]) - 1, MAX_HYPOTHESES).astype(int)
    return [column[chosen] for column in columns]


def _fitting_focals(quadrilaterals: Array, log_ratios: Array) -> tuple[Mask, Array]:
    """Return (q, r) whether a camera sees a rectangle of that log ratio so, and the focal length that fits it best."""
    ratio, cosine = sides_by_focal(quadrilaterals)
    ratio_error = np.abs(np.log(ratio)[:, :, None] - log_ratios)
    error = ratio_error / MAX_RATIO_ERROR + np.abs(cosine)[:, :, None] / MAX_COSINE  # (q, f, r)
    best = error.argmin(axis=1)
    fits = np.take_along_axis(error, best[:, None], axis=1)[:, 0] < 1.0
    return fits, FOCALS[best]


def sides_by_focal(maps: Array) -> tuple[Array, Array]:
    """Return (q, f) under each of FOCALS: the ratio of the sides of a rectangle that maps show, and their cosine.

    maps: (q, 3, 3) to the undistorted plane from sides of length 1.
    """
    one, two = maps[:, :, 0], maps[:, :, 1]
    p = FOCALS**2
    length_one = np.sqrt((one[:, :2] ** 2).sum(axis=1)[:, None] + p * one[:, 2:] ** 2)
    length_two = np.sqrt((two[:, :2] ** 2).sum(axis=1)[:, None] + p * two[:, 2:] ** 2)
    product = (one[:, :2] * two[:, :2]).sum(axis=1)[:, None] + p * one[:, 2:] * two[:, 2:]
    return length_one / length_two, product / (length_one * length_two)


def three_line_hypotheses(
    lines: list[Array],
    levels_x: Array,
    levels_y: Array,
    is_either_way: bool = False,
) -> Hypotheses:
    """Return cameras from two lines at different levels of one axis and one line at a level of the other.

    is_either_way: as for four_line_hypotheses().
    """
    maps, focal = _squares(lines[:MAX_THREE_LINE_LINES])
    rectangles = [
        _square_from_field(corners) for corners in _field_squares(levels_x, levels_y, is_either_way)
    ]
    rectangles += [
        _square_from_field(corners[:, ::-1])
        for corners in _field_squares(levels_y, levels_x, is_either_way)
    ]
    if not len(maps) or not rectangles:
        return NO_HYPOTHESES
    squares_from_field = np.array(rectangles)
    is_from_above = np.linalg.det(maps)[:, None] * np.linalg.det(squares_from_field) < 0
    square, rectangle = np.nonzero(is_from_above)
    square, rectangle = thinned(square, rectangle)
    return Hypotheses(maps[square] @ squares_from_field[rectangle], focal[square])


def _field_squares(own: Array, other: Array, is_either_way: bool) -> list[Array]:
    """Return corners (4, 2) mm of squares with a side on the third line, at level c, from level a to b."""
    return [
        np.array([[a, c], [b, c], [b, c + side], [a, c + side]])
        for a in own
        for b in own[(own > a) | ((own < a) & (not is_either_way))]
        for c in other
        for side in (b - a, a - b)
    ]


def _square_from_field(corners: Array) -> Array:
    """Return (3, 3) from field mm to the unit square, for a rectangle's corners (4, 2) in the square's order."""
    origin, one, two = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    linear = np.linalg.inv(np.stack([one, two], axis=1))
    result = np.eye(3)
    result[:2, :2], result[:2, 2] = linear, -linear @ origin
    return result


def _squares(lines: list[Array]) -> tuple[Array, Array]:
    """Return maps (n, 3, 3) from the unit square to the picture, with their focal lengths (n,)."""
    found = [
        _squares_of(lines[i], lines[j], lines[k])
        for i, j in parallel_pairs(lines)
        for k in range(len(lines))
        if k not in (i, j)
    ]
    return (
        np.concatenate([np.empty((0, 3, 3)), *(maps for maps, _ in found)]),
        np.concatenate([np.empty(0), *(focal for _, focal in found)]),
    )


def _squares_of(one: Array, two: Array, third: Array) -> tuple[Array, Array]:
    """Return the same of two parallels and a line across them, for those of THREE_LINE_FOCALS that see a square.

    For every focal length at once: rows are in the camera's frame, in which a point (x, y, 1) of the plane has the ray
    (x / f, y / f, 1), and a line (a, b, c) the plane with the normal (a f, b f, c).
    """
    crossings = [np.cross(line, third) for line in (one, two)]
    if min(abs(at[2]) for at in crossings) < MIN_CROSSING_DEPTH:
        return np.empty((0, 3, 3)), np.empty(0)
    focal = THREE_LINE_FOCALS
    ray_scale = np.stack([1 / focal, 1 / focal, np.ones(len(focal))], axis=1)
    # The crossing of two parallels in the picture is their vanishing point: its ray is their direction on the carpet.
    along_parallels = _unit(np.cross(one, two) * ray_scale)
    across = np.cross(_unit(third / ray_scale), along_parallels)
    is_determined = np.linalg.norm(across, axis=1) >= MIN_SINE
    across = _unit(across)
    near, far = (at / at[2] * ray_scale for at in crossings)  # rays to the two corners, at depth 1
    # b far - a near = across: how deep the two corners lie, for a distance of 1 between them.
    depth = (np.linalg.pinv(np.stack([-near, far], axis=2)) @ across[..., None])[..., 0]
    ahead = np.where(depth[:, :1] < 0, -1.0, 1.0)  # the third line may run either way
    depth, across = depth * ahead, across * ahead
    is_sound = is_determined & (depth.min(axis=1) > MIN_RAY_DEPTH)
    maps = np.stack([across, along_parallels, depth[:, :1] * near], axis=2) / ray_scale[..., None]
    return maps[is_sound], focal[is_sound]


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def check_corners(corners: Points) -> None:
    """Raise BadInput where corners (4, 2) px do not run clockwise about a convex area."""
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    if (edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] <= 0).any():
        raise BadInput(
            say("corners.order", "The corners do not run clockwise around the covered area."),
            say(
                "corners.order.fix",
                "Give the top left, top right, bottom right and bottom left corner of the covered "
                "area, as it is when corrected.",
            ),
            reason="bad-corners",
        )


def outline_about(corners: Points) -> Points:
    """Return an outline (4, 2) px of the area and some carpet about it, where its lines may lie."""
    middle = corners.mean(axis=0)
    return np.asarray(middle + (1 + CORNER_MARGIN) * (corners - middle))


def cameras_from_corners(
    corners: Points, region: Region, size: ImageSize
) -> list[RayCameraParameters]:
    """Return a camera for each bend under which the corners can be those of the region seen from above.

    corners (4, 2) raw px, clockwise: top left, top right, bottom right, bottom left of the region as it stands when
    corrected.
    """
    sides = np.array([region.width_mm, region.height_mm])
    origin, right, down = region.field_from_region(np.array([[0, 0], [1, 0], [0, 1]]) * sides)
    field_from_square = np.eye(3)
    field_from_square[:2] = np.column_stack([right - origin, down - origin, origin])
    square_from_field = np.linalg.inv(field_from_square)
    found = []
    for bend in CORNER_BENDS:
        plane = UndistortedPlane.of(size, bend)
        undistorted = plane.undistorted_from_raw(corners)
        homography = square_maps(undistorted[None])[0] @ square_from_field
        if not np.isfinite(homography).all():
            continue
        start = initial_camera(homography, _focal_of(homography), plane, size)
        if start is not None:
            found.append(start)
    return found


def _focal_of(homography: Array) -> float:
    """Return the focal length, half diagonals, under which right angles and lengths on the carpet come out best."""
    one, two = homography[:, 0], homography[:, 1]
    p = FOCALS**2
    length_one, length_two = (
        np.sqrt((column[:2] ** 2).sum() + p * column[2] ** 2) for column in (one, two)
    )
    cosine = (one[:2] @ two[:2] + p * one[2] * two[2]) / (length_one * length_two)
    error = np.abs(cosine) + np.abs(np.log(length_one / length_two))
    return float(
        FOCALS[np.argmin(error + USUAL_FOCAL_WEIGHT * np.abs(np.log(FOCALS / USUAL_FOCAL)))]
    )


def initial_camera(
    homography: Array, focal: float, plane: UndistortedPlane, size: ImageSize
) -> RayCameraParameters | None:
    """Return the camera of a homography from the field to the undistorted plane; focal is in the plane's units."""
    focal_px = focal * plane.unit_px
    try:
        rotation, position = pose_from_homography(
            np.diag([plane.unit_px, plane.unit_px, 1.0]) @ homography, focal_px
        )
    except FitFailed:
        return None
    return RayCameraParameters(
        Division.LENS,
        float(np.log(focal_px)),
        1.0,
        np.array(size.centre),
        np.array([plane.bend * focal**2]),
        rotation,
        position,
        np.zeros(0),
    )


@dataclass(frozen=True, eq=False)
class Scores:
    """(n,) each: the share of the drawn field that is there, its length, and length of markings within the border."""

    found: Array
    found_px: Array
    inner_px: Array

    @property
    def most_px(self) -> float:
        """The greatest length that one of them finds, if that is most of its drawing."""
        return float(np.max(self.found_px, where=self.found > MIN_CREDIBLE_FOUND, initial=0.0))


def score(
    homographies: Array,
    plane: UndistortedPlane,
    pattern: FieldPattern,
    ridges: RidgeMaps,
    inner: Mask,
) -> Scores:
    """Score homographies (n, 3, 3) from field mm to the undistorted plane. inner (k,): samples within the border."""
    parts = [
        _score_batch(homographies[start : start + MAX_BATCH], plane, pattern, ridges, inner)
        for start in range(0, len(homographies), MAX_BATCH)
    ]
    return Scores(*(np.concatenate([np.empty(0), *(part[i] for part in parts)]) for i in range(3)))


def harmonic_mean(one: Any, other: Any) -> Any:
    """Return it of numbers or arrays that are not negative; 0 for two zeros."""
    return 2 * one * other / np.maximum(one + other, 1e-9)


def _score_batch(
    maps: Array,
    plane: UndistortedPlane,
    pattern: FieldPattern,
    ridges: RidgeMaps,
    inner: Mask,
) -> tuple[Array, Array, Array]:
    raw = project(maps, pattern.points, plane)
    ahead = (
        project(maps, pattern.points + pattern.along * (pattern.step_mm / 4)[:, None], plane) - raw
    )
    step_px = np.linalg.norm(ahead, axis=-1) * 4
    inside = inside_picture(raw, ridges.size, 2) & np.isfinite(step_px)
    length = np.where(inside, step_px, 0.0)
    found = (
        ridges.found(
            np.where(inside[..., None], raw, -1.0), np.where(inside[..., None], ahead, 1.0)
        )
        * length
    )
    found_px = found.sum(axis=1)
    return found_px / np.maximum(length.sum(axis=1), 1e-9), found_px, found @ inner


def count_within(maps: Array, outer_mm: Array, plane: UndistortedPlane, points: Points) -> Array:
    """Return how many of the raw points (k, 2) each of (n, 3, 3) sees within the field's border (2,), in mm."""
    undistorted = homogeneous(np.nan_to_num(plane.undistorted_from_raw(points), nan=1e3)).astype(
        np.float32
    )
    field = undistorted @ np.linalg.inv(maps).transpose(0, 2, 1).astype(np.float32)
    with np.errstate(all="ignore"):
        return (np.abs(field[..., :2] / field[..., 2:]) < outer_mm).all(axis=-1).sum(axis=1)


def project(maps: Array, points: Points, plane: UndistortedPlane) -> Array:
    """Map field mm (k, 2) to raw px (n, k, 2) by each of (n, 3, 3), to a hundredth of a pixel."""
    mapped = homogeneous(points).astype(np.float32) @ maps.transpose(0, 2, 1).astype(np.float32)
    with np.errstate(all="ignore"):
        depth = np.where(mapped[..., 2:] > 0, mapped[..., 2:], np.nan)
        return plane.raw_from_undistorted(mapped[..., :2] / depth)
