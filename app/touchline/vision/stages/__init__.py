"""What a detection stage is, and the table of stages.

A frame goes through the stages of a config (configs/stages/*.yaml) in order; each adds what it found:

    pixels ─noise─▶ clean ─colours─▶ labels ─blobs─▶ blobs ─butterfly, tags, markers, ball─▶ found ─places─▶
              └─────edges─▶ sharpness ───────┘

A stage is made once for a camera and a picture size, and keeps what it must remember from frame to frame; run() takes
a FrameState and returns one with its own part filled in; picture() draws that part on request. To add one:
write touchline/vision/stages/NAME.py with a subclass of Stage, and add its line to STAGES. Everything works on the raw
picture: points are corrected, the picture is not.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.colour_profile import NAMES, Bgr, ColourProfile
from touchline.core.detections import Detection
from touchline.core.geometry import ImageSize
from touchline.core.options import Option
from touchline.core.registry import Registry
from touchline.vision.blobs.features import NO_BLOBS, Blobs
from touchline.vision.stages.localisation import FieldLocator

Picture = NDArray[np.uint8]  # (height, width, 3) BGR


@dataclass(frozen=True)
class StageContext:
    """What stays the same from frame to frame.

    view: from pixels to places, at any height. robot_z_mm: of the robots' patterns above the carpet. within: (height,
    width) 255 where anything is looked for, 0 elsewhere; None looks everywhere.
    """

    image_size: ImageSize
    profile: ColourProfile
    view: FieldLocator
    robot_z_mm: float = 150.0
    ball_radius_mm: float = 21.5
    within: NDArray[np.uint8] | None = None


@dataclass(frozen=True, eq=False)
class FrameState:
    """One frame on its way through the stages.

    clean: the picture without noise. labels: (height, width) the number of each pixel's colour in `colours`, counted
    from 1; 0 is anything else. light: how much brighter it is than when the colours were learned, in blue, green and
    red. sharpness: (height, width) how steep the picture is there, grey levels a pixel.
    """

    pixels: Picture
    clean: Picture
    labels: NDArray[np.uint8]
    colours: tuple[str, ...] = ()
    light: Bgr = (1.0, 1.0, 1.0)
    sharpness: NDArray[np.uint8] | None = None
    blobs: Blobs = NO_BLOBS
    found: tuple[Detection, ...] = ()
    notes: tuple[str, ...] = ()  # messages about this frame

    @classmethod
    def of(cls, pixels: Picture) -> "FrameState":
        return cls(pixels, pixels, np.zeros(pixels.shape[:2], np.uint8))

    def with_found(self, *more: Detection) -> "FrameState":
        return replace(self, found=(*self.found, *more))


class Stage(ABC):
    """One step of detection. One thread at a time: it may remember the frame before."""

    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    HELP: ClassVar[str]
    OPTIONS: ClassVar[tuple[Option, ...]]

    def __init__(self, options: Mapping[str, Any], context: StageContext) -> None:
        """options: as read_options gave them."""
        self._options, self._context = options, context

    @abstractmethod
    def run(self, state: FrameState) -> FrameState:
        """Return the same frame with this stage's part filled in."""

    def picture(self, state: FrameState) -> Picture:
        """Draw this stage's part of the state that run() returned, as a picture of its size: robots and markers with
        middle, front and number, where a stage draws nothing of its own."""
        drawn = state.clean // 2
        robots = [d for d in state.found if d.kind != "ball"]
        if not robots:
            return drawn
        middles = np.array([robot.pixel for robot in robots])
        px_per_mm = np.linalg.inv(self._context.view.spread(middles, self._context.robot_z_mm)[1])
        for robot, (x, y), turn in zip(robots, middles, px_per_mm, strict=True):
            paint = NAMES.get(robot.team or "", (255, 255, 255))
            at = (round(x), round(y))
            cv2.circle(drawn, at, 3, paint, -1, cv2.LINE_AA)
            if robot.orientation_rad is not None:
                dx, dy = turn @ (90 * np.array([np.cos(robot.orientation_rad), np.sin(robot.orientation_rad)]))
                cv2.line(drawn, at, (round(x + dx), round(y + dy)), paint, 2, cv2.LINE_AA)
            text = "?" if robot.id is None else str(robot.id)
            cv2.putText(drawn, text, (at[0] + 6, at[1] - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1,
                        cv2.LINE_AA)
        return drawn


STAGES: Registry[type[Stage]] = Registry("stage", {
    "noise": "touchline.vision.stages.noise:NoiseReduction",  # less grain: median, bilateral, or over time
    "colours": "touchline.vision.stages.colours:Colours",  # each pixel's colour from a lookup table
    "edges": "touchline.vision.stages.edges:Edges",  # how steep the picture is
    "blobs": "touchline.vision.stages.blobs:FindBlobs",  # patches of one colour: where, how large, of what form
    "butterfly": "touchline.vision.stages.ssl_robots:SslRobots",  # robots by the Small Size League's five dots
    "tags": "touchline.vision.stages.patch_robots:PatchRobots",  # robots by a team's colour beside their own
    "markers": "touchline.vision.stages.markers:Markers",  # patches of a team's colour, and no more
    "ball": "touchline.vision.stages.ball:FindBall",  # the ball
    "places": "touchline.vision.stages.localise:Localise",  # pixels to field mm, at each thing's own height
})
