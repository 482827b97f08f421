"""Patches of a team's colour, and no more: for leagues whose robots carry other patterns."""

from typing import ClassVar

import numpy as np

from touchline.core.colour_profile import NAMES
from touchline.core.detections import Detection
from touchline.core.options import Option
from touchline.vision.stages import FrameState, Stage


class Markers(Stage):
    NAME: ClassVar = "markers"
    TITLE: ClassVar = "Team markers"
    HELP: ClassVar = "Reports each patch of a team's colour with its position."
    OPTIONS: ClassVar = (
        Option("teams", "names", ("yellow", "blue"), "The teams' colours.", choices=tuple(NAMES)),
        Option("least_mm2", "float", 500.0, "Smaller patches are ignored.", (0, 1e6), "mm²"),
        Option("most_mm2", "float", 8000.0, "Larger patches are ignored.", (10, 1e6), "mm²"),
        Option("least_roundness", "float", 0.15, "Lowest roundness. 1 is a disc or a square, 0 a line.", (0, 1)),
    )

    def run(self, state: FrameState) -> FrameState:
        teams = {state.colours.index(name) + 1: name for name in self._options["teams"] if name in state.colours}
        blobs = state.blobs.only(np.isin(state.blobs.colour, list(teams))
                                 & (state.blobs.roundness >= self._options["least_roundness"]))
        if not len(blobs):
            return state
        z_mm = self._context.robot_z_mm
        mm2 = blobs.area * np.abs(np.linalg.det(np.nan_to_num(self._context.view.spread(blobs.middle, z_mm)[1])))
        good = np.flatnonzero((mm2 >= self._options["least_mm2"]) & (mm2 <= self._options["most_mm2"]))
        return state.with_found(*(Detection(
            "marker", (float(blobs.middle[i, 0]), float(blobs.middle[i, 1])), teams[int(blobs.colour[i])], z_mm=z_mm,
            confidence=float(blobs.roundness[i]), area_px=float(blobs.area[i])) for i in good))
