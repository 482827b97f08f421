"""Shapes to scale: a field's carpet, lines, arcs and goals as meshes, and level rectangles that carry a picture.

Expected error over a region is such a picture, on the carpet or at robot-top height.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import TouchlineError
from touchline.core.field import Arc, Field, Line, Region
from touchline.models import CameraModel
from touchline.workflows.calibration import uncertainty

ARC_STEP_DEG = 4.0
# where a field's definition leaves them out
GOAL_MM = {"width_mm": 1000.0, "depth_mm": 180.0, "height_mm": 160.0}
ERROR_PX = 256  # of the longer side: colours are interpolated between the grid's nodes
ERROR_ALPHA = 190  # of 255: the field's lines are seen through it
SHADES = 256


@dataclass(frozen=True, eq=False)
class Mesh:
    """vertices (n, 3) mm, field frame; faces (m, 3) indices of triangles."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """Return all parts as one mesh."""
        before = np.cumsum([0, *(len(part.vertices) for part in parts)])
        return cls(
            np.concatenate([part.vertices for part in parts]),
            np.concatenate(
                [part.faces + start for part, start in zip(parts, before, strict=False)]
            ),
        )


def carpet(field: Field) -> Mesh:
    """Return the carpet: the field and its boundary."""
    around = field.extras.get("boundary", {})
    x = field.length_mm / 2 + around.get("goal_mm", 0.0)
    y = field.width_mm / 2 + around.get("touch_mm", 0.0)
    return Mesh(
        np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )


def paint(field: Field) -> Mesh:
    """Return every line and arc in its true width."""
    shapes: list[Line | Arc] = [*field.lines.values(), *field.arcs.values()]
    return Mesh.joined(
        [_ribbon(_points(one), one.width_mm) for one in shapes]
        or [Mesh(np.empty((0, 3)), np.empty((0, 3), int))]
    )


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
    """Return the edges of both goals, (n, 2, 3) mm; none for a field that says nothing of goals."""
    if "goal" not in field.extras:
        return np.empty((0, 2, 3))
    size = {**GOAL_MM, **field.extras["goal"]}
    half, deep, high = size["width_mm"] / 2, size["depth_mm"], size["height_mm"]
    edges = []
    for end in (-1, 1):
        front, back = end * field.length_mm / 2, end * (field.length_mm / 2 + deep)
        corners = [(x, y, z) for x in (front, back) for y in (-half, half) for z in (0.0, high)]
        for a, b in combinations(corners, 2):
            is_edge = sum(of_a != of_b for of_a, of_b in zip(a, b, strict=True)) == 1  # of a box
            # it stays open at the carpet
            across_mouth = a[0] == b[0] == front and a[2] == b[2] == 0
            if is_edge and not across_mouth:
                edges.append((a, b))
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
        """Return the rectangle with these top-left, top-right and bottom-left corners (3, 2) mm."""
        across, along = corners[1] - corners[0], corners[2] - corners[0]
        width, height = float(np.linalg.norm(across)), float(np.linalg.norm(along))
        return cls(
            corners[0] + (across + along) / 2, width, height, across / width, along / height, z_mm
        )

    @classmethod
    def over(cls, region: Region, z_mm: float = 0.0) -> Self:
        """Return the whole region, as it stands in the corrected picture."""
        w, h = region.width_mm, region.height_mm
        return cls.through(
            region.field_from_region(np.array([[0.0, 0.0], [w, 0.0], [0.0, h]])), z_mm
        )


@dataclass(frozen=True, eq=False)
class ErrorSurface:
    """sigma_mm (rows, columns), NaN where the camera sees nothing; quad: its place."""

    sigma_mm: NDArray[np.float64]
    quad: TexturedQuad

    @property
    def largest_mm(self) -> float:
        return float(np.nanmax(self.sigma_mm))

    def picture(self, top_mm: float) -> NDArray[np.uint8]:
        """Return RGBA (h, w, 4): dark is 0, bright top_mm and more; transparent where nothing is known."""
        scale = ERROR_PX / max(self.quad.width_mm, self.quad.height_mm)
        size = [max(2, round(side * scale)) for side in (self.quad.width_mm, self.quad.height_mm)]
        values = opencv.resize_grid(self.sigma_mm, *size)
        shades = np.clip(np.nan_to_num(values) / top_mm * (SHADES - 1), 0, SHADES - 1).astype(int)
        picture = np.empty((*values.shape, 4), np.uint8)
        picture[..., :3] = opencv.viridis()[shades][..., ::-1]
        picture[..., 3] = np.where(np.isfinite(values), ERROR_ALPHA, 0)
        return picture


def error_surface(
    model: CameraModel, covariance: Any, region: Region, z_mm: float
) -> ErrorSurface | TouchlineError:
    """Compute the surface, or return why there is none."""
    try:
        found = uncertainty(model, covariance, region, z_mm)
    except TouchlineError as refusal:
        return refusal
    return ErrorSurface(np.array(found["grid"]["sigma_mm"], float), TexturedQuad.over(region, z_mm))
