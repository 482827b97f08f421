"""Patches of one colour: where to a fraction of a pixel, how large, and of what form."""

from dataclasses import replace
from typing import ClassVar

import cv2
import numpy as np

from touchline.core.colour_profile import NAMES, colour_name
from touchline.core.options import Option
from touchline.core.statements import say
from touchline.vision.blobs.features import Blobs, fine_middles
from touchline.vision.blobs.runs import runs_of
from touchline.vision.stages import FrameState, Picture, Stage

_FLOOD_PX = 120_000  # of one colour: more is a floor or badly learned, and would take longer than a frame

_MAX_BLOBS = 1000  # patches, the largest: no game has more, and noise has no end


class FindBlobs(Stage):
    NAME: ClassVar = "blobs"
    TITLE: ClassVar = "Blobs"
    HELP: ClassVar = "Joins pixels of one colour into patches and measures them."
    OPTIONS: ClassVar = (
        Option("least_px", "float", 6.0, "Smaller patches are treated as noise.", (1, 10_000), "px"),
        Option("least_mm2", "float", 250.0, "Smaller patches are treated as noise. The size is computed with the "
                                            "calibration.", (0, 1e6), "mm²"),
        Option("most_mm2", "float", 40_000.0, "Larger patches are ignored.", (10, 1e8), "mm²"),
        Option("join_px", "int", 0, "Gaps up to this many pixels are closed between pixels of one colour.", (0, 3),
               "px"),
    )

    def run(self, state: FrameState) -> FrameState:
        labels, notes = self._without_floods(state)
        if self._options["join_px"]:
            labels = _joined(labels, self._options["join_px"])
        blobs = Blobs.of(runs_of(labels))
        blobs = blobs.only(blobs.area >= self._options["least_px"])
        if len(blobs) > _MAX_BLOBS:
            blobs = blobs.only(np.isin(np.arange(len(blobs)), np.argsort(-blobs.area)[:_MAX_BLOBS]))
        if len(blobs):
            size = blobs.area * self._context.view.scale(blobs.middle) ** 2
            blobs = blobs.only((size >= self._options["least_mm2"]) & (size <= self._options["most_mm2"]))
        if len(blobs):
            blobs = replace(blobs, middle=fine_middles(state.clean, blobs, labels), sharpness=_rims(state, blobs))
        return replace(state, blobs=blobs, notes=state.notes + notes)

    def _without_floods(self, state: FrameState) -> tuple[np.ndarray, tuple[str, ...]]:
        """A thinned look first: a colour that is all over the picture would take seconds to join, and mean nothing."""
        thin = np.bincount(state.labels[::8, ::8].ravel(), minlength=len(state.colours) + 1)
        flooded = np.flatnonzero(64 * thin[1:] > _FLOOD_PX) + 1
        if not flooded.size:
            return state.labels, ()
        keep = np.arange(256, dtype=np.uint8)
        keep[flooded] = 0
        notes = tuple(say("note.colour-everywhere", "The colour {colour} covers {share:.0f} % of the image and is "
                          "ignored. Learn it again.", colour=colour_name(state.colours[i - 1]),
                          share=100 * thin[i] / thin.sum()) for i in flooded)
        return np.asarray(cv2.LUT(state.labels, keep), np.uint8), notes

    def picture(self, state: FrameState) -> Picture:
        """Each patch's box in its colour, and its middle."""
        drawn = state.clean // 2
        blobs = state.blobs
        for colour, (x0, y0, x1, y1), (x, y) in zip(blobs.colour, blobs.box.tolist(), blobs.middle, strict=True):
            paint = NAMES[state.colours[colour - 1]]
            cv2.rectangle(drawn, (x0 - 2, y0 - 2), (x1 + 2, y1 + 2), paint, 1)
            cv2.circle(drawn, (round(16 * x), round(16 * y)), 16, paint, -1, cv2.LINE_AA, 4)
        return drawn


def _joined(labels: np.ndarray, gap: int) -> np.ndarray:
    """A pixel without a colour takes the highest number beside it, and gives it back at the outer rim."""
    window = cv2.getStructuringElement(cv2.MORPH_RECT, (2 * gap + 1,) * 2)
    closed = cv2.morphologyEx(labels, cv2.MORPH_CLOSE, window)
    return np.where(labels > 0, labels, closed)


def _rims(state: FrameState, blobs: Blobs) -> np.ndarray:
    """(n,) mean steepness along each box's ellipse; NaN without the stage of edges."""
    if state.sharpness is None:
        return blobs.sharpness
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    half = (blobs.box[:, 2:] - blobs.box[:, :2] + 1) / 2
    middle = (blobs.box[:, :2] + blobs.box[:, 2:]) / 2
    ring = middle[:, None] + half[:, None] * np.stack([np.cos(turn), np.sin(turn)], -1)
    h, w = state.sharpness.shape
    x, y = np.clip(np.rint(ring[..., 0]), 0, w - 1).astype(int), np.clip(np.rint(ring[..., 1]), 0, h - 1).astype(int)
    return state.sharpness[y, x].mean(axis=1)
