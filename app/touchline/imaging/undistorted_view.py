"""A picture without its lens' bend, as it is drawn: of the raw picture's shape, and small enough to show its middle.

A barrel lens, undone, sends the picture's edges outwards. The drawing is scaled so that the middle of each of the
four edges is still in it; corners stick out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchline.core.geometry import ImageSize, Points
from touchline.models.contract import Rectification
from touchline.models.distortion import Distortion

MIN_SCALE = 1 / 3  # a lens that sends its edges further is drawn without them


@dataclass(frozen=True)
class UndistortedView(Rectification):
    """The rectification that draws it."""

    lens: Distortion

    @property
    def corrected_size(self) -> ImageSize:
        return self.lens.image_size

    @cached_property
    def scale(self) -> float:
        """Drawn pixels for one straight pixel: 1 at most from a pincushion, less from a barrel."""
        (width, height), (x, y) = self.lens.image_size, self.lens.image_size.centre
        raw = np.array([[0, y], [width - 1, y], [x, 0], [x, height - 1]], float)
        away = np.abs(self.lens.undistorted_from_raw(raw) - (x, y)).max(axis=1) / np.array([x, x, y, y])
        reached = away[np.isfinite(away) & (away > 0)]
        return float(np.clip(1 / reached.max(), MIN_SCALE, 1 / MIN_SCALE)) if reached.size else 1.0

    def corrected_from_raw(self, raw: Points) -> Points:
        """(..., 2) px; NaN beyond the lens' horizon."""
        return (self.lens.undistorted_from_raw(raw) - self._middle) * self.scale + self._middle

    def raw_from_corrected(self, corrected: Points) -> Points:
        return self.lens.raw_from_undistorted((corrected - self._middle) / self.scale + self._middle)

    @property
    def _middle(self) -> Points:
        return np.array(self.lens.image_size.centre)
