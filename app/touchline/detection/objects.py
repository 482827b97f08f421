"""Ball, team markers, and the position of everything that was detected, in field mm.

A position is where the pixel's line of sight meets the thing's own height:

    Σ = J Σ_px Jᵀ + σ_cal² I          J: how the position moves with the pixel

A model without rays knows the carpet only: there a robot's position is off by its height over the camera's, times how
far it is from below the camera. With the camera's position given by hand that is undone; else it is on_carpet.
"""

from dataclasses import replace
from typing import ClassVar

import cv2
import numpy as np

from touchline.core.options import Option
from touchline.detection.profile import NAMES
from touchline.detection.records import Detection
from touchline.detection.stages import FrameState, Picture, Stage

_ROBOT_TOP_RADIUS_MM = 75.0  # from a robot's middle: no ball is seen there
_SHARP = 40.0  # grey levels a pixel at the rim of a ball in a sharp picture


class Markers(Stage):
    NAME: ClassVar = "markers"
    TITLE: ClassVar = "Team markers"
    HELP: ClassVar = "Reports each patch of a team's colour with its position."
    OPTIONS: ClassVar = (
        Option("teams", "names", ("yellow", "blue"), "The teams' colours.", choices=tuple(NAMES)),
        Option("least_mm2", "float", 500.0, "Smaller patches are ignored.", (0, 1e6), "mm²"),
        Option("most_mm2", "float", 8000.0, "Larger patches are ignored.", (10, 1e6), "mm²"),
        Option(
            "least_roundness",
            "float",
            0.15,
            "Lowest roundness. 1 is a disc or a square, 0 a line.",
            (0, 1),
        ),
    )

    def run(self, state: FrameState) -> FrameState:
        teams = {
            state.colours.index(name) + 1: name
            for name in self._options["teams"]
            if name in state.colours
        }
        blobs = state.blobs.only(
            np.isin(state.blobs.colour, list(teams))
            & (state.blobs.roundness >= self._options["least_roundness"])
        )
        if not len(blobs):
            return state
        tops_mm = self._context.robot_tops_mm(teams[colour] for colour in blobs.colour.tolist())
        mm2 = blobs.area * np.abs(
            np.linalg.det(np.nan_to_num(self._context.view.spread(blobs.middle, tops_mm)[1]))
        )
        good = np.flatnonzero(
            (mm2 >= self._options["least_mm2"]) & (mm2 <= self._options["most_mm2"])
        )
        return state.with_found(
            *(
                Detection(
                    "marker",
                    (float(blobs.middle[i, 0]), float(blobs.middle[i, 1])),
                    teams[int(blobs.colour[i])],
                    z_mm=float(tops_mm[i]),
                    confidence=float(blobs.roundness[i]),
                    area_px=float(blobs.area[i]),
                )
                for i in good
            )
        )


class FindBall(Stage):
    NAME: ClassVar = "ball"
    TITLE: ClassVar = "Ball"
    HELP: ClassVar = (
        "Detects the ball by colour, size and shape. Its centre is one radius above the carpet."
    )
    OPTIONS: ClassVar = (
        Option("colour", "choice", "orange", "The ball's colour.", choices=tuple(NAMES)),
        Option(
            "least_size",
            "float",
            0.25,
            "Smallest patch of a ball, as a share of its expected area. Part of the "
            "ball may be hidden.",
            (0.01, 1),
        ),
        Option(
            "most_size",
            "float",
            2.2,
            "Largest patch of a ball, as a share of its expected area.",
            (1, 20),
        ),
        Option(
            "least_roundness", "float", 0.35, "Lowest roundness. 1 is a disc, 0 a line.", (0, 1)
        ),
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
        good = (
            (size >= options["least_size"])
            & (size <= options["most_size"])
            & (blobs.roundness >= options["least_roundness"])
            & ~self._on_a_robot(state, blobs.middle, mm_per_px)
        )
        like = np.exp(-(np.log(np.maximum(size, 1e-3)) ** 2)) * blobs.roundness
        if not np.isnan(blobs.sharpness).any():
            like *= np.minimum(1, 0.4 + 0.6 * blobs.sharpness / _SHARP)
        order = [i for i in np.argsort(-like) if good[i]][: options["most"]]
        return state.with_found(
            *(
                Detection(
                    "ball",
                    (float(blobs.middle[i, 0]), float(blobs.middle[i, 1])),
                    z_mm=radius,
                    confidence=float(like[i]),
                    area_px=float(blobs.area[i]),
                )
                for i in order
            )
        )

    def _on_a_robot(
        self, state: FrameState, middles: np.ndarray, mm_per_px: np.ndarray
    ) -> np.ndarray:
        robots = np.array([d.pixel for d in state.found if d.kind == "robot"]).reshape(-1, 2)
        if not len(robots) or self._context.robot_z_mm < 100:
            return np.zeros(len(middles), bool)  # a small robot's own colours are told by its tag
        away = np.einsum("nij,nrj->nri", mm_per_px, middles[:, None] - robots)
        return (np.linalg.norm(away, axis=-1) < _ROBOT_TOP_RADIUS_MM).any(axis=1)

    def picture(self, state: FrameState) -> Picture:
        drawn = state.clean // 2
        for ball in (d for d in state.found if d.kind == "ball"):
            x, y = ball.pixel
            radius = max(4.0, np.sqrt(ball.area_px / np.pi) + 3)
            cv2.circle(
                drawn,
                (round(16 * x), round(16 * y)),
                round(16 * radius),
                NAMES[self._options["colour"]],
                2,
                cv2.LINE_AA,
                4,
            )
        return drawn


class Localise(Stage):
    NAME: ClassVar = "places"
    TITLE: ClassVar = "Places"
    HELP: ClassVar = (
        "Converts pixels to field millimetres at the height of each object, with covariance."
    )
    OPTIONS: ClassVar = (
        Option(
            "robot_sigma_px",
            "float",
            0.05,
            "Uncertainty of a robot's centre in each direction.",
            (0.01, 5),
            "px",
        ),
        Option(
            "blob_sigma_px",
            "float",
            0.1,
            "Uncertainty of the centre of a ball or a patch in each direction.",
            (0.01, 5),
            "px",
        ),
        Option(
            "calibration_sigma_mm",
            "float",
            0.0,
            "Uncertainty of the calibration on the carpet in each direction.",
            (0, 500),
            "mm",
        ),
        Option(
            "hat_sigma_mm",
            "float",
            0.0,
            "Uncertainty of the calibration at robot-top height in each direction.",
            (0, 500),
            "mm",
        ),
    )

    def run(self, state: FrameState) -> FrameState:
        if self._context.view.model is None or not state.found:
            return state
        found = state.found
        places, mm_per_px = self._context.view.spread(
            np.array([d.pixel for d in found]), np.array([d.z_mm for d in found])
        )
        return replace(state, found=tuple(map(self._placed, found, places, mm_per_px)))

    def _placed(self, found: Detection, place: np.ndarray, mm_per_px: np.ndarray) -> Detection:
        """Left without a place where the line of sight meets nothing."""
        if not (np.isfinite(place).all() and np.isfinite(mm_per_px).all()):
            return found
        sigma = self._options["robot_sigma_px" if found.kind == "robot" else "blob_sigma_px"]
        known = self._options["calibration_sigma_mm" if found.kind == "ball" else "hat_sigma_mm"]
        spread = sigma**2 * mm_per_px @ mm_per_px.T + known**2 * np.eye(2)
        (xx, xy), (yx, yy) = spread.tolist()
        return replace(
            found,
            x_mm=float(place[0]),
            y_mm=float(place[1]),
            covariance_mm2=((xx, xy), (yx, yy)),
            on_carpet=not self._context.view.knows_heights and found.z_mm != 0,
        )
