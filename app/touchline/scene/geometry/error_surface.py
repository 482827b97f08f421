"""Expected error over a region as a coloured surface, on the carpet or at hat height."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import TouchlineError
from touchline.core.field import Region
from touchline.models import CameraModel
from touchline.scene.geometry.shapes import TexturedQuad
from touchline.workflows.calibration import uncertainty

WIDTH_PX = 256  # of the longer side: colours are interpolated between the grid's nodes
SEEN = 190  # of 255: the field's lines are seen through it
SHADES = 256


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
        scale = WIDTH_PX / max(self.quad.width_mm, self.quad.height_mm)
        size = [max(2, round(side * scale)) for side in (self.quad.width_mm, self.quad.height_mm)]
        values = opencv.resize_grid(self.sigma_mm, *size)
        shades = np.clip(np.nan_to_num(values) / top_mm * (SHADES - 1), 0, SHADES - 1).astype(int)
        picture = np.empty((*values.shape, 4), np.uint8)
        picture[..., :3] = opencv.viridis()[shades][..., ::-1]
        picture[..., 3] = np.where(np.isfinite(values), SEEN, 0)
        return picture


def error_surface(model: CameraModel, covariance: Any, region: Region, z_mm: float) -> ErrorSurface | TouchlineError:
    """Compute the surface, or return why there is none."""
    try:
        found = uncertainty(model, covariance, region, z_mm)
    except TouchlineError as refusal:
        return refusal
    return ErrorSurface(np.array(found["grid"]["sigma_mm"], float), TexturedQuad.over(region, z_mm))
