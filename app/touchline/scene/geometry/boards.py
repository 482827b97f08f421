"""Board poses before a camera whose lens was calibrated with them, and the part of the picture that they covered."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Conflict
from touchline.scene.geometry.frustum import Pyramid

SIDE_PX = 32  # of a cell in the coverage picture
MAX_MM = 1e6


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
            views = [view for view in lens["report"]["views"] if view.get("used") and view.get("quad_mm") is not None]
            quads = np.array([view["quad_mm"] for view in views], float).reshape(-1, 4, 3)
            cells = np.array(lens["report"]["coverage"]["cells"], float)
            intrinsics, (width, height) = lens["lens"], lens["image_size"]
            focal = float(intrinsics["focal_px"])
            half = (width / 2 / focal, height / 2 / (focal * float(intrinsics["aspect"])))
            known = (np.isfinite(quads).all() and np.abs(quads).max(initial=0) < MAX_MM and cells.ndim == 2
                     and np.isfinite(cells).all() and np.isfinite(half).all() and 0 < min(half) <= max(half) < 1e3)
        except (KeyError, TypeError, ValueError, AttributeError, ZeroDivisionError):
            known, views, quads = False, [], np.empty((0, 4, 3))
        if not known or not len(quads):
            raise Conflict("This lens does not contain the poses of the board.",
                           "Calibrate the lens again from its images. New calibrations contain the poses of the board.",
                           reason="no-board-poses")
        return cls(quads, tuple(str(view.get("name", "")) for view in views), half, cells)

    @property
    def depth_mm(self) -> float:
        """Distance at which the camera's picture is drawn: before the nearest board."""
        return float(min(0.5 * np.median(self.quads[..., 2]), 0.8 * max(self.quads[..., 2].min(), 1.0)))

    def coverage(self) -> NDArray[np.uint8]:
        """Return an RGB picture: bright cells have seen many corners, red ones none."""
        share = np.clip(self.cells / max(float(np.median(self.cells[self.cells > 0], axis=None))
                                         if (self.cells > 0).any() else 1.0, 1.0) / 2, 0, 1)
        picture = np.stack([40 + 60 * share, 70 + 160 * share, 60 + 80 * share], axis=-1).astype(np.uint8)
        picture[self.cells == 0] = (190, 60, 50)
        return np.kron(picture, np.ones((SIDE_PX, SIDE_PX, 1), np.uint8))

    def to_json(self) -> dict[str, Any]:
        return {"boards": len(self.quads), "nearest_mm": float(self.quads[..., 2].min()),
                "furthest_mm": float(self.quads[..., 2].max()), "covered": float((self.cells > 0).mean())}
