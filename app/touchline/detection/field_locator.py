"""From pixels to places at a height, and how many mm a pixel is there: what stages need of a calibration.

    locator = FieldLocator.of(model)                    any camera model; one without rays knows the carpet only
    places, mm_per_px = locator.spread(pixels, z_mm)    (n, 2) mm, and (n, 2, 2): how the place moves with the pixel
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import ImageSize, Points
from touchline.models import RayModel

Jacobians = NDArray[np.float64]  # (n, 2, 2)
_STEP_PX = 1.0
_GRID = (33, 25)


@dataclass(frozen=True, eq=False)
class FieldLocator:
    """model: a camera model, or None where there is no calibration: a pixel then is mm_per_px everywhere.

    eye_mm: the camera's position, given by hand for a model without rays, so that heights count.
    has_rays: the model can unproject to any height.
    """

    image_size: ImageSize
    model: Any = None
    flat_mm_per_px: float = 1.0
    eye_mm: tuple[float, float, float] | None = None
    has_rays: bool = False

    @classmethod
    def of(cls, model: Any, eye_mm: tuple[float, float, float] | None = None) -> Self:
        return cls(model.image_size, model, eye_mm=eye_mm, has_rays=isinstance(model, RayModel))

    @classmethod
    def flat(cls, image_size: ImageSize, mm_per_px: float) -> Self:
        """Without a calibration: sizes follow the given scale, and there are no field places."""
        return cls(image_size, None, mm_per_px)

    @property
    def knows_heights(self) -> bool:
        return self.has_rays or self.eye_mm is not None

    def field_from_raw(self, pixels: Points, z_mm: float = 0.0) -> Points:
        """(..., 2) px to (..., 2) mm in the plane at z_mm, on the carpet if heights are unknown; NaN out of reach."""
        pixels = np.asarray(pixels, float)
        if self.model is None:
            return (pixels - np.array(self.image_size.centre)) * (self.flat_mm_per_px, -self.flat_mm_per_px)
        if self.has_rays:
            return self.model.unproject(pixels, z_mm)
        carpet = self.model.field_from_corrected(self.model.corrected_from_raw(pixels))
        if self.eye_mm is None or not z_mm:
            return carpet
        # The line of sight meets height z that share of the way from the carpet to the eye.
        return carpet + (np.array(self.eye_mm[:2]) - carpet) * (z_mm / self.eye_mm[2])

    def spread(self, pixels: Points, z_mm: float = 0.0) -> tuple[Points, Jacobians]:
        """Places of (n, 2) pixels, and the derivative of (x, y) mm by (x, y) px."""
        pixels = np.asarray(pixels, float).reshape(-1, 2)
        steps = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * _STEP_PX
        found = self.field_from_raw(pixels[:, None] + steps, z_mm)
        across, down = (found[:, 1] - found[:, 2]) / (2 * _STEP_PX), (found[:, 3] - found[:, 4]) / (2 * _STEP_PX)
        return found[:, 0], np.stack([across, down], axis=-1)

    def scale(self, pixels: Points) -> NDArray[np.float64]:
        """About how many mm a pixel is on the carpet, (n,), from a coarse table; NaN out of reach."""
        at = np.asarray(pixels, float) / (np.array(tuple(self.image_size)) - 1) * (np.array(_GRID) - 1)
        columns, rows = np.clip(np.rint(at), 0, np.array(_GRID) - 1).astype(int).T
        return self._scales[rows, columns]

    @cached_property
    def _scales(self) -> NDArray[np.float64]:
        w, h = self.image_size
        grid = np.stack(np.meshgrid(np.linspace(0, w - 1, _GRID[0]), np.linspace(0, h - 1, _GRID[1])), axis=-1)
        turns = self.spread(grid.reshape(-1, 2))[1]
        return np.sqrt(np.abs(np.linalg.det(np.nan_to_num(turns)))).reshape(_GRID[1], _GRID[0])
