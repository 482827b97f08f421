"""Correction: a model becomes a map, and the map makes the corrected picture; the only remap there is.

The map says for each corrected pixel where it lies in the raw picture, in one pass. It can be made straight for the
size that is watched, with a margin around the field, so that nothing is ever resampled twice.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize, Points
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Calibration
from touchline.models.contract import Rectification

BLOCK_PX = 1 << 15  # so many pixels at a time stay in the processor's cache
MAX_MAP_PX = 50e6
MAX_ENLARGED_PX = 16e6  # of a view with a margin or a width: some seconds, and 0.4 GB
BORDER_BGR = (24, 20, 16)  # what the raw picture does not show


@dataclass(frozen=True)
class CorrectedView:
    """Which part of the corrected frame is drawn, and how large.

    margin_px: corrected pixels shown around the field on each side. width: of the picture that is drawn, px;
    None draws one pixel per corrected pixel.
    """

    margin_px: int = 0
    width: int | None = None

    def size(self, model: Rectification | Calibration) -> ImageSize:
        natural = self._natural(model)
        if self.width is None:
            return natural
        return ImageSize(self.width, max(2, round(natural.height * self.width / natural.width)))

    def _natural(self, model: Rectification | Calibration) -> ImageSize:
        corrected = model.corrected_size
        if not 0 <= self.margin_px <= 4096:
            raise BadInput(f"A margin of {self.margin_px} px is not possible.", "Use 0 to 4096.", reason="bad-view")
        if self.width is not None and not 16 <= self.width <= 8192:
            raise BadInput(f"A width of {self.width} px is not possible.", "Use 16 to 8192.", reason="bad-view")
        return ImageSize(corrected.width + 2 * self.margin_px, corrected.height + 2 * self.margin_px)

    def corrected_from_view(self, model: Rectification, points: Points) -> Points:
        """Pixels of the drawn picture to corrected pixels."""
        return (points + 0.5) / self._scale(model) - 0.5 - self.margin_px

    def view_from_corrected(self, model: Rectification, points: Points) -> Points:
        """Corrected pixels to pixels of the drawn picture."""
        return (points + self.margin_px + 0.5) * self._scale(model) - 0.5

    def _scale(self, model: Rectification) -> Points:
        return np.array([a / b for a, b in zip(self.size(model), self._natural(model), strict=True)])


@dataclass(frozen=True, eq=False)
class CorrectionMap:
    """raw_from_view at every pixel: raw_x, raw_y (height, width) float32 px; NaN where the model does not reach."""

    raw_x: NDArray[np.float32]
    raw_y: NDArray[np.float32]

    def apply(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The corrected picture of a raw (h, w[, channels]), bilinear, places rounded to 1/32 px: for live views."""
        return self._remap(pixels, cv2.INTER_LINEAR)

    def apply_finely(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The same, bicubic: a fifth of the error on fine detail for three times the time; for stills."""
        return self._remap(pixels, cv2.INTER_CUBIC)

    def _remap(self, pixels: NDArray[np.uint8], interpolation: int) -> NDArray[np.uint8]:
        return np.asarray(cv2.remap(pixels, *self._fixed, interpolation, borderMode=cv2.BORDER_CONSTANT,
                                    borderValue=BORDER_BGR), np.uint8)

    @cached_property
    def _fixed(self) -> tuple[NDArray, NDArray]:
        """OpenCV's quicker pair of maps: int16 places and an index into 32 × 32 weights; NaN becomes outside."""
        outside = -30_000.0  # fits int16, and no picture begins there
        x, y = (np.clip(np.nan_to_num(m, nan=outside), outside, -outside) for m in (self.raw_x, self.raw_y))
        return cv2.convertMaps(x, y, cv2.CV_16SC2)


def correction_map(model: Rectification, view: CorrectedView = CorrectedView(),
                   progress: Progress = no_progress) -> CorrectionMap:
    """The map for one view of one model."""
    size, natural = view.size(model), model.corrected_size
    if size.width * size.height > min(max(natural.width * natural.height, MAX_ENLARGED_PX), MAX_MAP_PX):
        raise BadInput(f"A corrected image of {size} is too large.",
                       "Choose a smaller margin, width or rectangle size.", reason="bad-view")
    raw_x = np.empty((size.height, size.width), np.float32)
    raw_y = np.empty_like(raw_x)
    x_c = view.corrected_from_view(model, np.arange(size.width)[:, None] * [1.0, 0.0])[:, 0]
    y_c = view.corrected_from_view(model, np.arange(size.height)[:, None] * [0.0, 1.0])[:, 1, None]
    step = max(1, BLOCK_PX // size.width)
    for top in range(0, size.height, step):
        progress(top / size.height, "Correcting")
        block = slice(top, top + step)
        raw_x[block], raw_y[block] = model.raw_from_corrected_grid(x_c, y_c[block])
    return CorrectionMap(raw_x, raw_y)
