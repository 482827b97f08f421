"""Robots of the Small Size League: a team's dot with four dots around it, which tell number and front.

Around each dot of a team's colour a ring is read for pink and green at the height of the robots' tops; the turn at
which four dots fit best is refined by their middles, and each dot's colour gives a digit of the number.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from touchline.core.colour_profile import NAMES, Bgr
from touchline.core.detections import Detection
from touchline.core.options import Option
from touchline.core.ssl_pattern import NUMBER_OF, TEAM_DOT_MM
from touchline.vision.blobs.features import Blobs
from touchline.vision.blobs.pattern_match import Patterns, patterns_at, unmixing
from touchline.vision.colour.table import as_bgr
from touchline.vision.stages import FrameState, Stage, StageContext

TEAMS = ("yellow", "blue")
_TEAM_DOT_MM2 = np.pi * (TEAM_DOT_MM / 2) ** 2
_APART_MM = 120.0  # two robots are never nearer than 180
_HALF_THERE = 0.35  # of a dot's usual share: less is hidden
_MAX_ROBOTS = 64


class SslRobots(Stage):
    NAME: ClassVar = "butterfly"
    TITLE: ClassVar = "Butterfly patterns"
    HELP: ClassVar = "Detects robots by the five dots of the Small Size League, with number and orientation."
    OPTIONS: ClassVar = (
        Option("least_size", "float", 0.3, "Smallest area of a team's dot, as a share of its expected area.",
               (0.05, 1)),
        Option("most_size", "float", 2.0, "Largest area of a team's dot, as a share of its expected area.", (1, 10)),
        Option("rest_mm", "float", 9.0, "Largest distance of the dots from their expected positions, rms.", (1, 40),
               "mm"),
        Option("sure", "float", 0.25, "A dot is classified as pink or green if one exceeds the other by this share.",
               (0, 1)),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._pink, self._green = (_usual(context, name) for name in ("pink", "green"))

    def run(self, state: FrameState) -> FrameState:
        teams = {state.colours.index(name) + 1: name for name in TEAMS if name in state.colours}
        blobs = state.blobs.only(np.isin(state.blobs.colour, list(teams)))
        if not len(blobs):
            return state
        view, z_mm = self._context.view, self._context.robot_z_mm
        places, mm_per_px = view.spread(blobs.middle, z_mm)
        area_mm2 = blobs.area * np.abs(np.linalg.det(np.nan_to_num(mm_per_px)))
        low, high = (self._options[name] * _TEAM_DOT_MM2 for name in ("least_size", "most_size"))
        fits = np.isfinite(places).all(axis=1) & (area_mm2 >= low) & (area_mm2 <= high)
        fits[np.flatnonzero(fits)[_MAX_ROBOTS * 4:]] = False
        if not fits.any():
            return state
        blobs, places, mm_per_px = blobs.only(fits), places[fits], mm_per_px[fits]
        found = patterns_at(state.clean, blobs.middle, mm_per_px, unmixing(self._pink, self._green, state.light))
        chosen = self._without_overlaps(found, places)
        px_per_mm = np.linalg.inv(mm_per_px)
        middles = blobs.middle + np.einsum("nij,nj->ni", px_per_mm, found.middle)
        return state.with_found(*(self._robot(found, i, teams[int(blobs.colour[i])], middles[i], blobs, z_mm)
                                  for i in chosen))

    def _without_overlaps(self, found: Patterns, places: np.ndarray) -> list[int]:
        """Return the patterns with three dots or more where they belong; of two that would overlap, the better."""
        there = (found.cover > _HALF_THERE).sum(axis=1)
        good = np.flatnonzero((there >= 3) & (found.rest_mm <= self._options["rest_mm"]))
        at = places + found.middle
        chosen: list[int] = []
        for i in good[np.argsort(found.rest_mm[good])]:
            if all(np.hypot(*(at[i] - at[j])) > _APART_MM for j in chosen):
                chosen.append(int(i))
        return chosen[:_MAX_ROBOTS]

    def _robot(self, found: Patterns, i: int, team: str, middle: np.ndarray, blobs: Blobs, z_mm: float) -> Detection:
        readable = bool((found.cover[i] > _HALF_THERE).all() and found.sure[i].min() >= self._options["sure"])
        number = NUMBER_OF[tuple(bool(g) for g in found.green[i])] if readable else None
        fit = float(np.exp(-(found.rest_mm[i] / self._options["rest_mm"]) ** 2))
        confidence = fit * float(np.clip(found.sure[i].min(), 0, 1)) if readable else 0.5 * fit
        # Five dots, each off by what is left on average, at 65 mm from the middle.
        sigma = max(float(found.rest_mm[i]), 0.5) / (np.sqrt(4) * 65)
        turn = float((found.turn[i] + np.pi) % (2 * np.pi) - np.pi)
        return Detection("robot", (float(middle[0]), float(middle[1])), team, number, z_mm=z_mm, orientation_rad=turn,
                         confidence=confidence, orientation_sigma_rad=float(sigma), area_px=float(blobs.area[i]))


def _usual(context: StageContext, name: str) -> Bgr:
    """A colour's middle sample, or how it usually looks."""
    samples = context.profile.colours.get(name)
    return as_bgr(np.mean([s.bgr for s in samples], axis=0)) if samples else NAMES[name]
