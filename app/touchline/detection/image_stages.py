"""Stages that work on the whole picture: less noise, each pixel's colour, how steep it is, patches of one colour.

The table of colours follows the light. Only colours that are looked for everywhere go into the labels; the others are
read where a robot is. A patch with a sharp rim is a thing, one without is a stain or a shine.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import cv2
import numpy as np
from cv2.typing import MatLike

from touchline.core.options import Option
from touchline.core.statements import say
from touchline.detection.blobs import Blobs, fine_middles, runs_of
from touchline.detection.colours import as_bgr, in_light, mean_light, table_of
from touchline.detection.profile import NAMES, Bgr, colour_name
from touchline.detection.stages import FrameState, Picture, Stage, StageContext


class NoiseReduction(Stage):
    """Over time, a pixel that has changed by less than `still` is a mixture of what it was and what it is."""

    NAME: ClassVar = "noise"
    TITLE: ClassVar = "Noise reduction"
    HELP: ClassVar = "Reduces image noise before colour classification."
    OPTIONS: ClassVar = (
        Option(
            "method",
            "choice",
            "none",
            "Method: none, the median of 3 × 3, bilateral, or over time.",
            choices=("none", "median", "bilateral", "temporal"),
        ),
        Option("strength", "float", 0.6, "Over time: weight of the past frames.", (0, 0.95)),
        Option(
            "still",
            "float",
            18.0,
            "Over time: pixels that change by more are treated as moving and are not filtered.",
            (1, 255),
            "grey levels",
        ),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._before: Picture | None = None

    def run(self, state: FrameState) -> FrameState:
        method, pixels = self._options["method"], state.pixels
        if method == "none":
            return state
        if method == "median":
            return replace(state, clean=np.asarray(cv2.medianBlur(pixels, 3), np.uint8))
        if method == "bilateral":
            return replace(state, clean=np.asarray(cv2.bilateralFilter(pixels, 5, 25, 2), np.uint8))
        return replace(state, clean=self._over_time(pixels))

    def _over_time(self, pixels: Picture) -> Picture:
        if self._before is None or self._before.shape != pixels.shape:
            self._before = pixels.copy()
            return self._before
        share = self._options["strength"]
        mixed = np.asarray(cv2.addWeighted(self._before, share, pixels, 1 - share, 0), np.uint8)
        change = cv2.absdiff(pixels, self._before)
        # A pixel moves as a whole: no channel lags behind the others.
        most = cv2.max(cv2.max(change[..., 0], change[..., 1]), change[..., 2])
        moving = cv2.compare(most, self._options["still"], cv2.CMP_GT)
        cv2.copyTo(pixels, moving, mixed)
        self._before = mixed
        return mixed

    def picture(self, state: FrameState) -> Picture:
        return state.clean


_EVERY = 5  # frames; lamps and clouds are slower
_NEW = 0.25  # of a fresh measure of the light, in what is believed
_STEP = 1.04  # a table is made anew when the light has changed by that
_MAX_GAIN, _MIN_GAIN = 2.5, 0.4  # beyond that, the picture shows something else


class Colours(Stage):
    NAME: ClassVar = "colours"
    TITLE: ClassVar = "Colours"
    HELP: ClassVar = (
        "Classifies the colour of each pixel with a lookup table, learned from a few samples."
    )
    OPTIONS: ClassVar = (
        Option(
            "everywhere",
            "names",
            ("orange", "yellow", "blue"),
            "Colours that are searched for in the whole image.",
            choices=tuple(NAMES),
        ),
        Option("follow", "bool", True, "Follow slow changes of the light."),
    )

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        super().__init__(options, context)
        self._learned_in = context.profile.light
        self._table, self._names = table_of(context.profile)
        wanted = np.array([False] + [name in options["everywhere"] for name in self._names])
        self._wanted = np.where(wanted[self._table], self._table, 0).astype(np.uint8)
        self._gain: np.ndarray = np.ones(3)
        self._gain_of_table = np.ones(3)
        self._now = self._wanted
        self._frames = 0

    @property
    def light(self) -> Bgr:
        """How much brighter it is than when the colours were learned, in blue, green and red."""
        return as_bgr(self._gain)

    def run(self, state: FrameState) -> FrameState:
        if self._options["follow"] and self._learned_in is not None:
            self._measure(state.pixels)
        codes = _codes(state.clean)
        labels = np.empty(codes.shape, np.uint8)
        np.take(self._now, codes, out=labels, mode="clip")
        if self._context.within is not None:
            cv2.bitwise_and(labels, self._context.within, labels)
        return replace(state, labels=labels, colours=self._names, light=self.light)

    def _measure(self, pixels: Picture) -> None:
        first = self._frames == 0
        self._frames += 1
        if not first and self._frames % _EVERY:
            return
        light = np.array(mean_light(pixels)) + 1
        fresh = np.clip(light / (np.array(self._learned_in) + 1), _MIN_GAIN, _MAX_GAIN)
        self._gain = fresh if first else self._gain * (fresh / self._gain) ** _NEW
        change = self._gain / self._gain_of_table
        if max(change.max(), 1 / change.min()) > _STEP:
            self._gain_of_table = self._gain.copy()
            self._now = in_light(self._wanted, self.light)

    def picture(self, state: FrameState) -> Picture:
        """All colours of the table, those too that are not looked for everywhere, on a dim picture."""
        named = in_light(self._table, as_bgr(self._gain_of_table))[_codes(state.clean)]
        paint = np.array([(0, 0, 0)] + [NAMES[name] for name in self._names], np.uint8)
        return np.where(named[..., None] > 0, paint[named], state.clean // 3)


def _codes(pixels: Picture) -> np.ndarray:
    """(height, width) uint16: where each pixel stands in the table."""
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2BGR565).view(np.uint16).reshape(pixels.shape[:2])


class Edges(Stage):
    NAME: ClassVar = "edges"
    TITLE: ClassVar = "Edges"
    HELP: ClassVar = (
        "Measures the gradient of the image at each pixel. Blobs are weighted by their edges."
    )
    OPTIONS: ClassVar = (
        Option(
            "channel",
            "choice",
            "all",
            "Grey only, or the largest gradient of the three colours.",
            choices=("grey", "all"),
        ),
    )

    def run(self, state: FrameState) -> FrameState:
        planes = (
            cv2.split(state.clean)
            if self._options["channel"] == "all"
            else [cv2.cvtColor(state.clean, cv2.COLOR_BGR2GRAY)]
        )
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


# of one colour: more is a floor or badly learned, and would take longer than a frame
_FLOOD_PX = 120_000

_MAX_BLOBS = 1000  # patches, the largest: no game has more, and noise has no end


class FindBlobs(Stage):
    NAME: ClassVar = "blobs"
    TITLE: ClassVar = "Blobs"
    HELP: ClassVar = "Joins pixels of one colour into patches and measures them."
    OPTIONS: ClassVar = (
        Option(
            "least_px", "float", 6.0, "Smaller patches are treated as noise.", (1, 10_000), "px"
        ),
        Option(
            "least_mm2",
            "float",
            250.0,
            "Smaller patches are treated as noise. The size is computed with the calibration.",
            (0, 1e6),
            "mm²",
        ),
        Option("most_mm2", "float", 40_000.0, "Larger patches are ignored.", (10, 1e8), "mm²"),
        Option(
            "join_px",
            "int",
            0,
            "Gaps up to this many pixels are closed between pixels of one colour.",
            (0, 3),
            "px",
        ),
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
            blobs = blobs.only(
                (size >= self._options["least_mm2"]) & (size <= self._options["most_mm2"])
            )
        if len(blobs):
            blobs = replace(
                blobs,
                middle=fine_middles(state.clean, blobs, labels),
                sharpness=_rims(state, blobs),
            )
        return replace(state, blobs=blobs, notes=state.notes + notes)

    def _without_floods(self, state: FrameState) -> tuple[np.ndarray, tuple[str, ...]]:
        """A thinned look first: a colour that is all over the picture would take seconds to join, and mean nothing."""
        thin = np.bincount(state.labels[::8, ::8].ravel(), minlength=len(state.colours) + 1)
        flooded = np.flatnonzero(64 * thin[1:] > _FLOOD_PX) + 1
        if not flooded.size:
            return state.labels, ()
        keep = np.arange(256, dtype=np.uint8)
        keep[flooded] = 0
        notes = tuple(
            say(
                "note.colour-everywhere",
                "The colour {colour} covers {share:.0f} % of the image and is "
                "ignored. Learn it again.",
                colour=colour_name(state.colours[i - 1]),
                share=100 * thin[i] / thin.sum(),
            )
            for i in flooded
        )
        return np.asarray(cv2.LUT(state.labels, keep), np.uint8), notes

    def picture(self, state: FrameState) -> Picture:
        """Each patch's box in its colour, and its middle."""
        drawn = state.clean // 2
        blobs = state.blobs
        for colour, (x0, y0, x1, y1), (x, y) in zip(
            blobs.colour, blobs.box.tolist(), blobs.middle, strict=True
        ):
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
    x, y = (
        np.clip(np.rint(ring[..., 0]), 0, w - 1).astype(int),
        np.clip(np.rint(ring[..., 1]), 0, h - 1).astype(int),
    )
    return state.sharpness[y, x].mean(axis=1)
