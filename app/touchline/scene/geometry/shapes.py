"""Shapes to scale: a field's carpet, lines, arcs and goals as meshes, and level rectangles that carry a picture."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Arc, Field, Line, Region

ARC_STEP_DEG = 4.0
GOAL_MM = {"width_mm": 1000.0, "depth_mm": 180.0, "height_mm": 160.0}  # where a field's definition leaves them out


@dataclass(frozen=True, eq=False)
class Mesh:
    """vertices (n, 3) mm, field frame; faces (m, 3) indices of triangles."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        before = np.cumsum([0, *(len(part.vertices) for part in parts)])
        return cls(np.concatenate([part.vertices for part in parts]),
                   np.concatenate([part.faces + start for part, start in zip(parts, before, strict=False)]))


def carpet(field: Field) -> Mesh:
    """Return the carpet: the field and its boundary."""
    around = field.extras.get("boundary", {})
    x = field.length_mm / 2 + around.get("goal_mm", 0.0)
    y = field.width_mm / 2 + around.get("touch_mm", 0.0)
    return Mesh(np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]]))


def paint(field: Field) -> Mesh:
    """Return every line and arc in its true width."""
    shapes: list[Line | Arc] = [*field.lines.values(), *field.arcs.values()]
    return Mesh.joined([_ribbon(_points(one), one.width_mm) for one in shapes]
                       or [Mesh(np.empty((0, 3)), np.empty((0, 3), int))])


def _points(shape: Line | Arc) -> NDArray[np.float64]:
    if isinstance(shape, Line):
        return shape.sample(2)
    return shape.sample(2 + int(abs(shape.end_deg - shape.start_deg) / ARC_STEP_DEG))


def _ribbon(points: NDArray[np.float64], width_mm: float) -> Mesh:
    """Return a band around a polyline (n, 2); its ends reach half a width further, so that lines meet in corners."""
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) * width_mm / 2
    ends = points.copy()
    ends[0] -= along[0] * width_mm / 2
    ends[-1] += along[-1] * width_mm / 2
    flat = np.stack([ends + across, ends - across], axis=1).reshape(-1, 2)
    first = 2 * np.arange(len(points) - 1)[:, None]
    faces = np.concatenate([first + np.array(corners) for corners in ((0, 1, 2), (1, 3, 2))])
    return Mesh(np.column_stack([flat, np.zeros(len(flat))]), faces)


def goals(field: Field) -> NDArray[np.float64]:
    """(n, 2, 3) mm: the edges of both goals; none for a field that says nothing of goals."""
    if "goal" not in field.extras:
        return np.empty((0, 2, 3))
    size = {**GOAL_MM, **field.extras["goal"]}
    half, deep, high = size["width_mm"] / 2, size["depth_mm"], size["height_mm"]
    edges = []
    for end in (-1, 1):
        front, back = end * field.length_mm / 2, end * (field.length_mm / 2 + deep)
        spots = [(x, y, z) for x in (front, back) for y in (-half, half) for z in (0.0, high)]
        # an edge joins two corners that differ in one coordinate; the mouth stays open at the carpet
        edges += [(p, q) for i, p in enumerate(spots) for q in spots[i + 1:]
                  if sum(a != b for a, b in zip(p, q, strict=True)) == 1 and not (p[0] == q[0] == front
                                                                                  and p[2] == q[2] == 0)]
    return np.array(edges, float)


@dataclass(frozen=True, eq=False)
class TexturedQuad:
    """A rectangle in the plane at z_mm: its middle (2,), its size, and unit vectors (2,) to its right and down it."""

    middle_mm: NDArray[np.float64]
    width_mm: float
    height_mm: float
    right: NDArray[np.float64]
    down: NDArray[np.float64]
    z_mm: float = 0.0

    @classmethod
    def through(cls, corners: NDArray[np.float64], z_mm: float = 0.0) -> Self:
        """From its top-left, top-right and bottom-left corners (3, 2) mm."""
        across, along = corners[1] - corners[0], corners[2] - corners[0]
        width, height = float(np.linalg.norm(across)), float(np.linalg.norm(along))
        return cls(corners[0] + (across + along) / 2, width, height, across / width, along / height, z_mm)

    @classmethod
    def over(cls, region: Region, z_mm: float = 0.0) -> Self:
        """The whole region, as it stands in the corrected picture."""
        w, h = region.width_mm, region.height_mm
        return cls.through(region.field_from_region(np.array([[0.0, 0.0], [w, 0.0], [0.0, h]])), z_mm)
