"""How steep the picture is: a patch with a sharp rim is a thing, one without is a stain or a shine."""

from dataclasses import replace
from typing import ClassVar

import cv2
import numpy as np
from cv2.typing import MatLike

from touchline.core.options import Option
from touchline.vision.stages import FrameState, Picture, Stage


class Edges(Stage):
    NAME: ClassVar = "edges"
    TITLE: ClassVar = "Edges"
    HELP: ClassVar = "Measures the gradient of the image at each pixel. Blobs are weighted by their edges."
    OPTIONS: ClassVar = (
        Option("channel", "choice", "all", "Grey only, or the largest gradient of the three colours.",
               choices=("grey", "all")),
    )

    def run(self, state: FrameState) -> FrameState:
        planes = (cv2.split(state.clean) if self._options["channel"] == "all"
                  else [cv2.cvtColor(state.clean, cv2.COLOR_BGR2GRAY)])
        steepest = _steep(planes[0])
        for plane in planes[1:]:
            cv2.max(steepest, _steep(plane), steepest)
        return replace(state, sharpness=steepest)

    def picture(self, state: FrameState) -> Picture:
        if state.sharpness is None:
            return super().picture(state)
        return np.asarray(cv2.cvtColor(state.sharpness, cv2.COLOR_GRAY2BGR), np.uint8)


_CROSS = cv2.getStructuringElement(cv2.MORPH_RECT, (3, 3))


def _steep(plane: MatLike) -> Picture:
    """The most that a pixel differs within its 3 × 3: as much as a gradient tells, and all in bytes."""
    return np.asarray(cv2.subtract(cv2.dilate(plane, _CROSS), cv2.erode(plane, _CROSS)), np.uint8)
