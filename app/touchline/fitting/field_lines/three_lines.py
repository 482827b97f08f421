"""Camera hypotheses from three lines, two of them parallel on the carpet, for a series of focal lengths.

With a focal length f, a line in the picture is a plane through the camera. The two parallels' planes meet in their
direction d₁; the third line runs square to it, along d₂ = n₃ × d₁. How far the parallels are apart on the field gives
the scale, so that a square drawn between them has its four corners in the picture: a quadrilateral like any other.
"""

import numpy as np

from touchline.core.geometry import Array
from touchline.fitting.field_lines.four_lines import Hypotheses, parallel_pairs, thinned

FOCALS = np.geomspace(0.55, 9.0, 18)  # half diagonals
MAX_LINES = 5


def three_line_hypotheses(lines: list[Array], levels_x: Array, levels_y: Array, is_either_way: bool = False,
                          ) -> Hypotheses:
    """Return cameras from two lines at different levels of one axis and one line at a level of the other.

    is_either_way: as for four_line_hypotheses().
    """
    maps, focal = _squares(lines[:MAX_LINES])
    rectangles = [_square_from_rectangle(corners) for corners in _field_squares(levels_x, levels_y, is_either_way)]
    rectangles += [_square_from_rectangle(corners[:, ::-1])
                   for corners in _field_squares(levels_y, levels_x, is_either_way)]
    if not len(maps) or not rectangles:
        return Hypotheses(np.empty((0, 3, 3)), np.empty(0))
    from_field = np.array(rectangles)
    from_above = np.linalg.det(maps)[:, None] * np.linalg.det(from_field) < 0
    square, rectangle = np.nonzero(from_above)
    square, rectangle = thinned(square, rectangle)
    return Hypotheses(maps[square] @ from_field[rectangle], focal[square])


def _field_squares(own: Array, other: Array, is_either_way: bool) -> list[Array]:
    """Return corners (4, 2) mm of squares: along the third line, at level c, from level a to b, then on from c."""
    return [np.array([[a, c], [b, c], [b, c + side], [a, c + side]])
            for a in own for b in own[(own > a) | ((own < a) & (not is_either_way))]
            for c in other for side in (b - a, a - b)]


def _square_from_rectangle(corners: Array) -> Array:
    """Return (3, 3) from field mm to the unit square, for a rectangle's corners (4, 2) in the square's order."""
    origin, one, two = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    linear = np.linalg.inv(np.stack([one, two], axis=1))
    result = np.eye(3)
    result[:2, :2], result[:2, 2] = linear, -linear @ origin
    return result


def _squares(lines: list[Array]) -> tuple[Array, Array]:
    """Return maps (n, 3, 3) from the unit square to the picture, with their focal lengths (n,)."""
    found = [_squares_of(lines[i], lines[j], lines[k]) for i, j in parallel_pairs(lines)
             for k in range(len(lines)) if k not in (i, j)]
    return (np.concatenate([np.empty((0, 3, 3)), *(maps for maps, _ in found)]),
            np.concatenate([np.empty(0), *(focal for _, focal in found)]))


def _squares_of(one: Array, two: Array, third: Array) -> tuple[Array, Array]:
    starts = [np.cross(line, third) for line in (one, two)]
    if min(abs(s[2]) for s in starts) < 0.05:
        return np.empty((0, 3, 3)), np.empty(0)
    camera = np.stack([1 / FOCALS, 1 / FOCALS, np.ones(len(FOCALS))], axis=1)
    first = _unit(np.cross(one, two) * camera)
    second = np.cross(_unit(third / camera), first)
    square = np.linalg.norm(second, axis=1) >= 0.5
    second = _unit(second)
    near, far = (s / s[2] * camera for s in starts)  # rays, at depth 1
    # b far - a near = second: how deep the two corners lie, for a distance of one between them.
    depth = (np.linalg.pinv(np.stack([-near, far], axis=2)) @ second[..., None])[..., 0]
    ahead = np.where(depth[:, :1] < 0, -1.0, 1.0)
    depth, second = depth * ahead, second * ahead
    fine = square & (depth.min(axis=1) > 0.02)
    maps = np.stack([second, first, depth[:, :1] * near], axis=2) / camera[..., None]
    return maps[fine], FOCALS[fine]


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
