"""What a pinhole sees: the frustum of a camera, a lens's boards before it, and the viewpoint of the scene's window.

A lens bends its picture, and a frustum is a pinhole's: drawn on one, only the undistorted picture lies over the field
that stands behind it. A pinhole cannot see 180°: of a very wide lens the middle MAX_FOV_DEG are shown.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Conflict
from touchline.core.field import Field
from touchline.core.geometry import ImageSize, Points
from touchline.core.json_values import JsonObject
from touchline.imaging.correction import CorrectionMap
from touchline.models.ray_camera import RayCamera

MAX_FOV_DEG = 120.0
MAX_ASPECT = 8.0  # either way: an absurd lens leaves a line of its border, or a point
BORDER_STEPS = 33  # points along each side of the picture
RAY_MM = 1000.0  # along a ray: any length will do
DEPTH_SHARE = 0.22  # of the camera's height: how far below it its picture is drawn
MAX_DEPTH_MM = 1200.0
IN_FRONT = 0.985  # of the frustum's depth, where lines are drawn over its picture
CELL_PX = 32  # side of a cell in the coverage picture
MAX_BOARD_MM = 1e6  # of a board's corner from the camera
MAX_HALF = 1e3  # of a picture's extent at depth 1
WINDOW_FOV_RAD = float(np.radians(50))  # from top to bottom: about what an eye takes in of a screen
WIDE_ASPECT = 1.2  # of a window that shows all from as near as that
MARGIN = 1.12  # of the field's extent


class Pyramid:
    """The view of a pinhole. half: half the picture's extent at depth 1, across and down."""

    half: tuple[float, float]

    @property
    def fov_rad(self) -> float:
        """Angle from the picture's top to its bottom."""
        return float(2 * np.arctan(self.half[1]))

    @property
    def aspect(self) -> float:
        return self.half[0] / self.half[1]


@dataclass(frozen=True, eq=False)
class Frustum(Pyramid):
    """position_mm (3,); field_from_camera (3, 3), whose columns are right, down and ahead. half: of the undistorted
    picture. complete: whether that is all that the camera sees."""

    model: RayCamera
    position_mm: NDArray[np.float64]
    field_from_camera: NDArray[np.float64]
    half: tuple[float, float]
    complete: bool

    @classmethod
    def of(cls, model: RayCamera) -> Self:
        """Return the widest pinhole view that holds the whole border of the camera's picture, up to MAX_FOV_DEG."""
        rays = model.rays(_border(model.image_size))
        # no pinhole sees what lies beside or behind it
        depth = np.where(rays[:, 2:] > 0, rays[:, 2:], np.nan)
        with np.errstate(all="ignore"):
            at_depth_1 = np.abs(rays[:, :2] / depth)
        in_front = np.isfinite(at_depth_1).all(axis=1)
        max_half = float(np.tan(np.radians(MAX_FOV_DEG / 2)))
        extent = (
            np.nanmax(at_depth_1[in_front], axis=0)
            if in_front.any()
            else np.array([max_half, max_half])
        )
        not_too_narrow = np.maximum(extent, extent[::-1] / MAX_ASPECT)
        half = np.clip(not_too_narrow, max_half / MAX_ASPECT**3, max_half)
        return cls(
            model,
            np.array(model.position_mm),
            model.camera_from_field.T,
            (float(half[0]), float(half[1])),
            bool(in_front.all() and (extent <= max_half).all()),
        )

    @property
    def height_mm(self) -> float:
        return float(self.position_mm[2])

    @property
    def tilt_deg(self) -> float:
        """Angle of the optical axis against straight down."""
        return float(np.degrees(np.arccos(np.clip(-self.field_from_camera[2, 2], -1, 1))))

    def fov_within(self, aspect: float) -> float:
        """Return the vertical angle at which a window of this aspect shows the whole frustum."""
        return float(2 * np.arctan(max(self.half[1], self.half[0] / aspect)))

    @property
    def depth_mm(self) -> float:
        """Distance from the camera at which its picture is drawn."""
        return min(MAX_DEPTH_MM, DEPTH_SHARE * self.height_mm)

    @property
    def ahead(self) -> NDArray[np.float64]:
        """(3,): the centre of the drawn picture."""
        return self.position_mm + self.field_from_camera[:, 2] * self.depth_mm

    def drawn_closer(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move points (n, 3) along their rays to just before the drawn picture; NaN beside or behind the camera.

        Seen from the camera they stay where they are.
        """
        from_camera = points - self.position_mm
        depth = from_camera @ self.field_from_camera[:, 2:]
        with np.errstate(all="ignore"):
            share = np.where(depth > 0, IN_FRONT * self.depth_mm / depth, np.nan)
        return self.position_mm + from_camera * share

    def footprint(self) -> Points:
        """Return the border of the picture on the carpet, closed, (n, 2) field mm; NaN where it looks past it."""
        outline = self.model.unproject(_border(self.model.image_size))
        return np.concatenate([outline, outline[:1]])

    def undistortion(self, width: int, raw_size: ImageSize) -> CorrectionMap:
        """Return the map of the undistorted picture of this width from raw pictures of that size."""
        if (width, raw_size) not in self._maps:
            height = max(2, round(width / self.aspect))
            self._maps[width, raw_size] = self._undistortion(width, height, raw_size)
        return self._maps[width, raw_size]

    @cached_property
    def _maps(self) -> dict[tuple[int, ImageSize], CorrectionMap]:
        return {}

    def _undistortion(self, width: int, height: int, raw_size: ImageSize) -> CorrectionMap:
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * self.half[0]
        y = ((np.arange(height) + 0.5) / height * 2 - 1) * self.half[1]
        rays = np.stack([*np.meshgrid(x, y), np.ones((height, width))], axis=-1) * RAY_MM
        raw = self.model.project(self.position_mm + rays @ self.field_from_camera.T)
        scale = np.array(
            [raw / own for raw, own in zip(raw_size, self.model.image_size, strict=True)]
        )
        # Pixels are counted from the centre of the first one; pictures of two sizes agree in its outer corner.
        raw = ((raw + 0.5) * scale - 0.5).astype(np.float32)
        return CorrectionMap(raw[..., 0], raw[..., 1])


def _border(size: ImageSize) -> Points:
    """Return points (n, 2) px around the picture, clockwise from its top-left corner."""
    t = np.linspace(0, 1, BORDER_STEPS)[:-1]
    right, bottom = size.width - 1, size.height - 1
    sides = [
        (t * right, 0 * t),
        (0 * t + right, t * bottom),
        ((1 - t) * right, 0 * t + bottom),
        (0 * t, (1 - t) * bottom),
    ]
    return np.concatenate([np.stack(side, axis=1) for side in sides])


@dataclass(frozen=True, eq=False)
class BoardViews(Pyramid):
    """quads (n, 4, 3) mm in the camera's frame (x right, y down, z ahead): the outermost corners of every used view.

    half: half the picture's extent at depth 1, across and down, undistorted. cells (rows, columns): how many
    corners were seen in each part of the picture.
    """

    quads: NDArray[np.float64]
    names: tuple[str, ...]
    half: tuple[float, float]
    cells: NDArray[np.float64]

    @classmethod
    def of(cls, lens: Mapping[str, Any]) -> Self:
        """Read a stored lens; Conflict where it has no board poses."""
        try:
            views = [
                view
                for view in lens["report"]["views"]
                if view.get("used") and view.get("quad_mm") is not None
            ]
            quads = np.array([view["quad_mm"] for view in views], float).reshape(-1, 4, 3)
            cells = np.array(lens["report"]["coverage"]["cells"], float)
            intrinsics, (width, height) = lens["lens"], lens["image_size"]
            focal_px = float(intrinsics["focal_px"])
            half = (width / 2 / focal_px, height / 2 / (focal_px * float(intrinsics["aspect"])))
            is_valid = (
                np.isfinite(quads).all()
                and np.abs(quads).max(initial=0) < MAX_BOARD_MM
                and cells.ndim == 2
                and np.isfinite(cells).all()
                and np.isfinite(half).all()
                and 0 < min(half) <= max(half) < MAX_HALF
            )
        except (KeyError, TypeError, ValueError, AttributeError, ZeroDivisionError):
            is_valid, views, quads = False, [], np.empty((0, 4, 3))
        if not is_valid or not len(quads):
            raise Conflict(
                "This lens does not contain the poses of the board.",
                "Calibrate the lens again from its images. New calibrations contain the poses of the board.",
                reason="no-board-poses",
            )
        return cls(quads, tuple(str(view.get("name", "")) for view in views), half, cells)

    @property
    def depth_mm(self) -> float:
        """Distance at which the camera's picture is drawn: before the nearest board."""
        depths = self.quads[..., 2]
        return float(min(0.5 * np.median(depths), 0.8 * max(depths.min(), 1.0)))

    def coverage(self) -> NDArray[np.uint8]:
        """Return an RGB picture: bright cells have seen many corners, red ones none."""
        has_corners = self.cells > 0
        usual = float(np.median(self.cells[has_corners], axis=None)) if has_corners.any() else 1.0
        # twice the usual number is brightest
        share = np.clip(self.cells / max(usual, 1.0) / 2, 0, 1)
        picture = np.stack([40 + 60 * share, 70 + 160 * share, 60 + 80 * share], axis=-1).astype(
            np.uint8
        )
        picture[self.cells == 0] = (190, 60, 50)
        return np.kron(picture, np.ones((CELL_PX, CELL_PX, 1), np.uint8))

    def to_json(self) -> JsonObject:
        return {
            "boards": len(self.quads),
            "nearest_mm": float(self.quads[..., 2].min()),
            "furthest_mm": float(self.quads[..., 2].max()),
            "covered": float((self.cells > 0).mean()),
        }


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """position_mm, look_at_mm, up (3,), field frame; fov_rad from top to bottom of the window."""

    position_mm: NDArray[np.float64]
    look_at_mm: NDArray[np.float64]
    up: NDArray[np.float64]
    fov_rad: float = WINDOW_FOV_RAD

    @classmethod
    def above(cls, field: Field, aspect: float) -> Self:
        """Look at the whole field, x to the right and y up. aspect: of the window, width over height."""
        half = max(field.length_mm / aspect, field.width_mm) / 2 * MARGIN
        return cls(
            np.array([0.0, 0.0, half / np.tan(WINDOW_FOV_RAD / 2)]),
            np.zeros(3),
            np.array([0.0, 1.0, 0.0]),
        )

    @classmethod
    def free(cls, field: Field, highest_mm: float, aspect: float) -> Self:
        """Look from beside the field, so that cameras of that height are seen as well."""
        reach = max(field.length_mm, field.width_mm, 1.6 * highest_mm) * max(
            1.0, WIDE_ASPECT / aspect
        )
        return cls(
            np.array([0.25 * reach, -1.05 * reach, 0.75 * reach]),
            np.array([0.0, 0.0, 0.3 * highest_mm]),
            np.array([0.0, 0.0, 1.0]),
        )

    @classmethod
    def through(cls, frustum: Frustum, aspect: float) -> Self:
        """Look from the camera's position along its axis, with its whole picture in the window."""
        return cls(
            frustum.position_mm,
            frustum.ahead,
            -frustum.field_from_camera[:, 1],
            frustum.fov_within(aspect),
        )

    @classmethod
    def beside(cls, boards: BoardViews) -> Self:
        """Look at boards, and from behind at the camera before which they are: it looks along z with y down."""
        far = float(boards.quads[..., 2].max())
        return cls(
            np.array([0.8 * far, -0.5 * far, -0.5 * far]),
            np.array([0.0, 0.0, 0.5 * far]),
            np.array([0.0, -1.0, 0.0]),
        )
