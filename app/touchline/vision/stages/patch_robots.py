"""Robots of the small leagues: a team's patch beside one or two patches of the robot's own colours.

The way from the team's patch to the others tells the front, and the colours, counted from the left as the robot looks,
tell the number.
"""

from typing import Any, ClassVar

import numpy as np

from touchline.core.colour_profile import NAMES
from touchline.core.detections import Detection
from touchline.core.options import Option
from touchline.vision.blobs.features import Blobs
from touchline.vision.stages import FrameState, Stage

OWN = tuple(name for name in NAMES if name not in ("orange", "yellow", "blue"))
_TURNED_RAD = 0.012  # a tenth of a pixel at each end of a tag of a dozen pixels


class PatchRobots(Stage):
    NAME: ClassVar = "tags"
    TITLE: ClassVar = "Two-colour tags"
    HELP: ClassVar = "Detects small robots by a team's patch and the robot's own colours next to it."
    OPTIONS: ClassVar = (
        Option("teams", "names", ("yellow", "blue"), "The teams' colours.", choices=tuple(NAMES)),
        Option("numbers", "names", ("green", "pink", "cyan", "purple", "red"),
               "The robot's own colours in the order of the numbers from 0. With two own patches, the number is first "
               "· count + second.", choices=OWN),
        Option("patches", "choice", "1", "Number of patches of its own that a robot has.", choices=("1", "2")),
        Option("apart_mm", "float", 37.0, "Distance from the centre of the team's patch to the centre of the robot's "
                                          "own patch.", (5, 200),
               "mm"),
        Option("slack", "float", 0.45, "Tolerance of that distance, as a share.", (0.05, 1)),
        Option("front_deg", "float", 90.0, "Direction of the front, counter-clockwise from the direction to the "
                                           "robot's own patch.", (-180, 180),
               "°"),
    )

    def run(self, state: FrameState) -> FrameState:
        z_mm, blobs = self._context.robot_z_mm, state.blobs
        if not len(blobs):
            return state
        places, mm_per_px = self._context.view.spread(blobs.middle, z_mm)
        team = _numbers_of(state, self._options["teams"])
        own = _numbers_of(state, self._options["numbers"])
        teams = [i for i in range(len(blobs)) if int(blobs.colour[i]) in team]
        others = np.array([i for i in range(len(blobs)) if int(blobs.colour[i]) in own], np.intp)
        found, taken = [], set()
        # The surest first: where robots touch, a patch belongs to the nearer one.
        for i in sorted(teams, key=lambda i: self._misfit(places, i, others)):
            free = np.array([j for j in others if j not in taken], np.intp)
            mine = self._own(places, i, free)
            if mine is None:
                continue
            taken.update(mine)
            found.append(self._robot(state, blobs, places, mm_per_px, i, mine, own))
        return state.with_found(*found)

    def _misfit(self, places: np.ndarray, i: int, others: np.ndarray) -> float:
        return float(np.min(np.abs(_away(places, i, others) - self._options["apart_mm"]), initial=np.inf))

    def _own(self, places: np.ndarray, i: int, free: np.ndarray) -> list[int] | None:
        """The patches at the right distance, or None."""
        apart, slack, count = self._options["apart_mm"], self._options["slack"], int(self._options["patches"])
        off = np.abs(_away(places, i, free) - apart)
        near = [int(j) for j in free[np.argsort(off)][:count] if abs(_away(places, i, j) - apart) <= slack * apart]
        return near if len(near) == count else None

    def _robot(self, state: FrameState, blobs: Blobs, places: np.ndarray, mm_per_px: np.ndarray, i: int, mine:
               list[int], own: dict[int, int]) -> Detection:
        way = places[mine].mean(axis=0) - places[i]
        turn = np.arctan2(way[1], way[0]) + np.radians(self._options["front_deg"])
        # From the robot's left to its right.
        left = np.array([-np.sin(turn), np.cos(turn)])
        ordered = sorted(mine, key=lambda j: -float((places[j] - places[i]) @ left))
        number = 0
        for j in ordered:
            number = number * len(self._options["numbers"]) + own[int(blobs.colour[j])]
        middle = (blobs.middle[i] + blobs.middle[mine].mean(axis=0)) / 2
        fit = 1 - abs(np.hypot(*way) - self._options["apart_mm"]) / self._options["apart_mm"]
        scale = float(np.sqrt(abs(np.linalg.det(mm_per_px[i]))))
        return Detection("robot", (float(middle[0]), float(middle[1])), state.colours[int(blobs.colour[i]) - 1],
                         int(number), z_mm=self._context.robot_z_mm,
                         orientation_rad=float((turn + np.pi) % (2 * np.pi) - np.pi),
                         confidence=float(np.clip(fit, 0, 1)),
                         orientation_sigma_rad=float(np.hypot(_TURNED_RAD, 0.15 * scale / self._options["apart_mm"])),
                         area_px=float(blobs.area[[i, *mine]].sum()))


def _numbers_of(state: FrameState, names: tuple[str, ...]) -> dict[int, int]:
    """Which place among the names each of the table's numbers has."""
    return {state.colours.index(name) + 1: place for place, name in enumerate(names) if name in state.colours}


def _away(places: np.ndarray, i: int, others: Any) -> np.ndarray:
    return np.linalg.norm(places[others] - places[i], axis=-1)
