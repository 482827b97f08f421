"""The ball: an orange patch of the ball's size that lies on no robot."""

from typing import ClassVar

import cv2
import numpy as np

from touchline.core.colour_profile import NAMES
from touchline.core.detections import Detection
from touchline.core.options import Option
from touchline.vision.stages import FrameState, Picture, Stage

_HAT_MM = 75.0  # from a robot's middle: no ball is seen there
_SHARP = 40.0  # grey levels a pixel at the rim of a ball in a sharp picture


class FindBall(Stage):
    NAME: ClassVar = "ball"
    TITLE: ClassVar = "Ball"
    HELP: ClassVar = "Detects the ball by colour, size and shape. Its centre is one radius above the carpet."
    OPTIONS: ClassVar = (
        Option("colour", "choice", "orange", "The ball's colour.", choices=tuple(NAMES)),
        Option("least_size", "float", 0.25, "Smallest patch of a ball, as a share of its expected area. Part of the "
                                            "ball may be hidden.",
               (0.01, 1)),
        Option("most_size", "float", 2.2, "Largest patch of a ball, as a share of its expected area.", (1, 20)),
        Option("least_roundness", "float", 0.35, "Lowest roundness. 1 is a disc, 0 a line.", (0, 1)),
        Option("most", "int", 1, "Number of balls reported, the most certain first.", (1, 50)),
    )

    def run(self, state: FrameState) -> FrameState:
        options, radius = self._options, self._context.ball_radius_mm
        if options["colour"] not in state.colours:
            return state
        blobs = state.blobs.only(state.blobs.colour == state.colours.index(options["colour"]) + 1)
        if not len(blobs):
            return state
        mm_per_px = self._context.view.spread(blobs.middle, radius)[1]
        size = blobs.area * np.abs(np.linalg.det(np.nan_to_num(mm_per_px))) / (np.pi * radius**2)
        good = ((size >= options["least_size"]) & (size <= options["most_size"])
                & (blobs.roundness >= options["least_roundness"]) & ~self._on_a_robot(state, blobs.middle, mm_per_px))
        like = np.exp(-np.log(np.maximum(size, 1e-3)) ** 2) * blobs.roundness
        if not np.isnan(blobs.sharpness).any():
            like *= np.minimum(1, 0.4 + 0.6 * blobs.sharpness / _SHARP)
        order = [i for i in np.argsort(-like) if good[i]][:options["most"]]
        return state.with_found(*(Detection(
            "ball", (float(blobs.middle[i, 0]), float(blobs.middle[i, 1])), z_mm=radius,
            confidence=float(like[i]), area_px=float(blobs.area[i])) for i in order))

    def _on_a_robot(self, state: FrameState, middles: np.ndarray, mm_per_px: np.ndarray) -> np.ndarray:
        robots = np.array([d.pixel for d in state.found if d.kind == "robot"]).reshape(-1, 2)
        if not len(robots) or self._context.robot_z_mm < 100:
            return np.zeros(len(middles), bool)  # a small robot's own colours are told by its tag
        away = np.einsum("nij,nrj->nri", mm_per_px, middles[:, None] - robots)
        return (np.linalg.norm(away, axis=-1) < _HAT_MM).any(axis=1)

    def picture(self, state: FrameState) -> Picture:
        drawn = state.clean // 2
        for ball in (d for d in state.found if d.kind == "ball"):
            x, y = ball.pixel
            radius = max(4.0, np.sqrt(ball.area_px / np.pi) + 3)
            cv2.circle(drawn, (round(16 * x), round(16 * y)), round(16 * radius), NAMES[self._options["colour"]], 2,
                       cv2.LINE_AA, 4)
        return drawn
