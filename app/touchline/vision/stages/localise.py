"""Places in field mm: each pixel's line of sight, met at the thing's own height, and how sure that is.

    Σ = J Σ_px Jᵀ + σ_cal² I          J: how the place moves with the pixel

A model without rays knows the carpet only: there a robot's place is off by its height over the camera's, times how far
it is from below the camera. With the camera's position given by hand that is undone; else it is on_carpet.
"""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from touchline.core.detections import Detection
from touchline.core.options import Option
from touchline.vision.stages import FrameState, Stage


class Localise(Stage):
    NAME: ClassVar = "places"
    TITLE: ClassVar = "Places"
    HELP: ClassVar = "Converts pixels to field millimetres at the height of each object, with covariance."
    OPTIONS: ClassVar = (
        Option("robot_sigma_px", "float", 0.05, "Uncertainty of a robot's centre in each direction.", (0.01, 5), "px"),
        Option("blob_sigma_px", "float", 0.1, "Uncertainty of the centre of a ball or a patch in each direction.",
               (0.01, 5), "px"),
        Option("calibration_sigma_mm", "float", 0.0, "Uncertainty of the calibration on the carpet in each "
                                                     "direction.", (0, 500),
               "mm"),
        Option("hat_sigma_mm", "float", 0.0, "Uncertainty of the calibration at robot-top height in each direction.",
               (0, 500), "mm"),
    )

    def run(self, state: FrameState) -> FrameState:
        if self._context.view.model is None or not state.found:
            return state
        placed = list(state.found)
        for z_mm in {d.z_mm for d in state.found}:
            group = [i for i, d in enumerate(state.found) if d.z_mm == z_mm]
            pixels = np.array([state.found[i].pixel for i in group])
            places, mm_per_px = self._context.view.spread(pixels, z_mm)
            for i, place, turns in zip(group, places, mm_per_px, strict=True):
                placed[i] = self._placed(placed[i], place, turns)
        return replace(state, found=tuple(placed))

    def _placed(self, found: Detection, place: np.ndarray, mm_per_px: np.ndarray) -> Detection:
        """Left without a place where the line of sight meets nothing."""
        if not (np.isfinite(place).all() and np.isfinite(mm_per_px).all()):
            return found
        sigma = self._options["robot_sigma_px" if found.kind == "robot" else "blob_sigma_px"]
        known = self._options["calibration_sigma_mm" if found.kind == "ball" else "hat_sigma_mm"]
        spread = sigma**2 * mm_per_px @ mm_per_px.T + known**2 * np.eye(2)
        (xx, xy), (yx, yy) = spread.tolist()
        return replace(found, x_mm=float(place[0]), y_mm=float(place[1]),
                       covariance_mm2=((xx, xy), (yx, yy)),
                       on_carpet=not self._context.view.knows_heights and found.z_mm != 0)
