"""Camera hypotheses from three lines, two of them parallel on the carpet, for a series of focal lengths.

With a focal length f, a line in the picture is a plane through the camera. The two parallels' planes meet in their
direction d₁; the third line runs square to it, along d₂ = n₃ × d₁. How far the parallels are apart on the field gives
the scale, so that a square drawn between them has its four corners in the picture: a quadrilateral like any other.
"""

import numpy as np

from app.core.geometry import Array
from app.fitting.field_lines.four_lines import Hypotheses, parallel_pairs, thinned

FOCALS = np.geomspace(0.55, 9.0, 18)  # half diagonals
MAX_LINES = 5


def three_line_hypotheses(lines: list[Array], levels_x: Array, levels_y: Array) -> Hypotheses:
    """Return cameras from two lines at different levels of one axis and one line at a level of the other."""
    squares = _squares(lines[:MAX_LINES])
    rectangles = [_square_from_rectangle(corners) for corners in _field_squares(levels_x, levels_y)]
    rectangles += [_square_from_rectangle(corners[:, ::-1]) for corners in _field_squares(levels_y, levels_x)]
    if not squares or not rectangles:
        return Hypotheses(np.empty((0, 3, 3)), np.empty(0))
    maps, focal = np.array([s for s, _ in squares]), np.array([f for _, f in squares])
    from_field = np.array(rectangles)
    from_above = np.linalg.det(maps)[:, None] * np.linalg.det(from_field) < 0
    square, rectangle = np.nonzero(from_above)
    square, rectangle = thinned(square, rectangle)
    return Hypotheses(maps[square] @ from_field[rectangle], focal[square])


def _field_squares(own: Array, other: Array) -> list[Array]:
    """Return corners (4, 2) mm of squares: along the third line, at level c, from level a to b, then on from c."""
    return [np.array([[a, c], [b, c], [b, c + side], [a, c + side]])
            for a in own for b in own[own != a] for c in other for side in (b - a, a - b)]


def _square_from_rectangle(corners: Array) -> Array:
    """Return (3, 3) from field mm to the unit square, for a rectangle's corners (4, 2) in the square's order."""
    origin, one, two = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    linear = np.linalg.inv(np.stack([one, two], axis=1))
    result = np.eye(3)
    result[:2, :2], result[:2, 2] = linear, -linear @ origin
    return result


def _squares(lines: list[Array]) -> list[tuple[Array, float]]:
    """Return each (3, 3) from the unit square to the picture, with its focal length."""
    found = [(_square(lines[i], lines[j], lines[k], f), float(f)) for i, j in parallel_pairs(lines)
             for k in range(len(lines)) if k not in (i, j) for f in FOCALS]
    return [(square, f) for square, f in found if square is not None]


def _square(one: Array, two: Array, third: Array, focal: float) -> Array | None:
    camera = np.array([1 / focal, 1 / focal, 1.0])
    first = np.cross(one, two) * camera
    first = first / np.linalg.norm(first)
    normal = third / camera
    second = np.cross(normal / np.linalg.norm(normal), first)
    if np.linalg.norm(second) < 0.5:
        return None
    second = second / np.linalg.norm(second)
    starts = [np.cross(line, third) for line in (one, two)]
    if min(abs(s[2]) for s in starts) < 0.05:
        return None
    rays = [s / s[2] * camera for s in starts]  # depth 1
    # b ray₁ - a ray₀ = second: how deep the two corners lie, for a distance of one between them.
    depth = np.linalg.lstsq(np.stack([-rays[0], rays[1]], axis=1), second, rcond=None)[0]
    if depth[0] < 0:
        depth, second = -depth, -second
    if min(depth) <= 0.02:
        return None
    corners = np.array([depth[0] * rays[0], depth[1] * rays[1]])
    plane = np.array([second, first, corners[0]]).T / camera[:, None]  # from the unit square to the picture
    return plane if min(corners[:, 2]) > 0 else None
