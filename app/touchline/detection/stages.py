"""Detection stages: what one is, the table of them, and a pipeline: frame in, detections out.

A frame goes through the stages of a config (configs/stages/*.yaml) in order; each adds what it found:

    pixels ─noise─▶ clean ─colours─▶ labels ─blobs─▶ blobs ─butterfly, tags, markers, ball─▶ found ─places─▶
              └─────edges─▶ sharpness ───────┘

A stage is made once for a camera and a picture size, and keeps what it must remember from frame to frame; run() takes
a FrameState and returns one with its own part filled in; picture() draws that part on request. To add one: write
touchline/detection/NAME.py with a subclass of Stage, and add its line to STAGES. Everything works on the raw picture:
points are corrected, the picture is not.

    config = StageConfig.from_json({"name": "ssl", "title": …, "stages": [{"stage": "colours", "follow": true}, …]})
    pipeline = StagePipeline(config, context)
    result = pipeline.process(pixels, clock=time.perf_counter, pictures=("colours",))

A pipeline belongs to one camera at one size, and keeps its stages' state; one thread at a time.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.options import Option, read_options
from touchline.core.registry import Registry
from touchline.detection.blobs import NO_BLOBS, Blobs
from touchline.detection.profile import NAMES, Bgr, ColourProfile
from touchline.detection.records import Detection, Detections, FieldLocator

Picture = NDArray[np.uint8]  # (height, width, 3) BGR


@dataclass(frozen=True)
class StageContext:
    """What stays the same from frame to frame.

    view: from pixels to places, at any height. robot_z_mm: of the robots' patterns above the carpet; team_z_mm: of
    those teams' whose robots are known. within: (height, width) 255 where anything is looked for, 0 elsewhere; None
    looks everywhere.
    """

    image_size: ImageSize
    profile: ColourProfile
    view: FieldLocator
    robot_z_mm: float = 150.0
    ball_radius_mm: float = 21.5
    within: NDArray[np.uint8] | None = None
    team_z_mm: Mapping[str, float] = field(default_factory=dict)

    def robot_tops_mm(self, teams: Iterable[str | None]) -> NDArray[np.float64]:
        """Return the height of each team's robots, (n,) mm."""
        return np.array([self.team_z_mm.get(team or "", self.robot_z_mm) for team in teams])


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
        tops_mm = np.array([robot.z_mm for robot in robots])
        px_per_mm = np.linalg.inv(self._context.view.spread(middles, tops_mm)[1])
        for robot, (x, y), turn in zip(robots, middles, px_per_mm, strict=True):
            paint = NAMES.get(robot.team or "", (255, 255, 255))
            at = (round(x), round(y))
            cv2.circle(drawn, at, 3, paint, -1, cv2.LINE_AA)
            if robot.orientation_rad is not None:
                dx, dy = turn @ (
                    90 * np.array([np.cos(robot.orientation_rad), np.sin(robot.orientation_rad)])
                )
                cv2.line(drawn, at, (round(x + dx), round(y + dy)), paint, 2, cv2.LINE_AA)
            text = "?" if robot.id is None else str(robot.id)
            cv2.putText(
                drawn,
                text,
                (at[0] + 6, at[1] - 6),
                cv2.FONT_HERSHEY_SIMPLEX,
                0.5,
                (255, 255, 255),
                1,
                cv2.LINE_AA,
            )
        return drawn


STAGES: Registry[type[Stage]] = Registry(
    "stage",
    {
        # less grain: median, bilateral, or over time
        "noise": "touchline.detection.image_stages:NoiseReduction",
        # each pixel's colour from a lookup table
        "colours": "touchline.detection.image_stages:Colours",
        "edges": "touchline.detection.image_stages:Edges",  # how steep the picture is
        # patches of one colour: where, how large, of what form
        "blobs": "touchline.detection.image_stages:FindBlobs",
        # robots by the Small Size League's five dots
        "butterfly": "touchline.detection.robots:SslRobots",
        "tags": "touchline.detection.robots:PatchRobots",  # robots by a team's colour beside their own
        "markers": "touchline.detection.objects:Markers",  # patches of a team's colour, and no more
        "ball": "touchline.detection.objects:FindBall",  # the ball
        # pixels to field mm, at each thing's own height
        "places": "touchline.detection.objects:Localise",
    },
)


# views: the picture with everything that was found; what one stage made of it
DRAWN, STAGE = "detections", "stage-"
MAX_STAGES = 20
_FORM = 'Send {"name", "title", "stages": [{"stage": NAME, OPTION: VALUE, …}, …]}, and optionally "corrected": true.'
# What a stage reads that another one writes.
_AFTER = {
    "blobs": "colours",
    "butterfly": "blobs",
    "tags": "blobs",
    "markers": "blobs",
    "ball": "blobs",
}


@dataclass(frozen=True)
class StageConfig:
    """Stages in order with their options, read and checked. corrected: they look at the corrected picture."""

    name: str
    title: str
    stages: tuple[tuple[str, Mapping[str, Any]], ...]
    corrected: bool = False

    @classmethod
    def from_json(cls, value: Any) -> Self:
        if not isinstance(value, Mapping) or set(value) - {"corrected"} != {
            "name",
            "title",
            "stages",
        }:
            raise BadInput("This is not a plan of stages.", _FORM, reason="bad-stages")
        listed, corrected = value["stages"], value.get("corrected", False)
        if not isinstance(corrected, bool):
            raise BadInput(
                "The value of corrected in the plan must be true or false.",
                _FORM,
                reason="bad-stages",
            )
        if not isinstance(listed, (list, tuple)) or not 0 < len(listed) <= MAX_STAGES:
            raise BadInput(
                f"A plan must have 1 to {MAX_STAGES} stages.", _FORM, reason="bad-stages"
            )
        name, title = value["name"], value["title"]
        if not all(
            isinstance(text, str) and 0 < len(text) <= 80 and text.isprintable()
            for text in (name, title)
        ):
            raise BadInput(
                "The plan of stages needs a name and a title.", _FORM, reason="bad-stages"
            )
        stages: list[tuple[str, Mapping[str, Any]]] = []
        for entry in listed:
            if not isinstance(entry, Mapping) or not isinstance(entry.get("stage"), str):
                raise BadInput("An entry of the plan names no stage.", _FORM, reason="bad-stages")
            stage = entry["stage"]
            options = read_options(
                STAGES[stage].OPTIONS, {k: v for k, v in entry.items() if k != "stage"}
            )
            needed, before = _AFTER.get(stage), [done for done, _ in stages]
            if stage in before or (needed and needed not in before):
                raise BadInput(
                    f"The stage {stage} is in the wrong position.",
                    f"List it once, after {needed}." if needed else "List it once.",
                    reason="bad-stages",
                )
            stages.append((stage, options))
        return cls(name, title, tuple(stages), corrected)

    def to_json(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "title": self.title,
            **({"corrected": True} if self.corrected else {}),
            "stages": [
                {
                    "stage": name,
                    **{k: list(v) if isinstance(v, tuple) else v for k, v in options.items()},
                }
                for name, options in self.stages
            ],
        }


@dataclass(frozen=True, eq=False)
class FrameResult:
    """The result of a frame. took_ms: of each stage, empty without a clock. pictures: those that were asked for."""

    detections: Detections
    took_ms: Mapping[str, float] = field(default_factory=dict)
    pictures: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class StagePipeline:
    """The stages of one camera."""

    def __init__(self, config: StageConfig, context: StageContext) -> None:
        self.config, self.context = config, context
        self._stages: list[Stage] = [
            STAGES[name](options, context) for name, options in config.stages
        ]

    def process(
        self,
        pixels: NDArray[np.uint8],
        *,
        clock: Callable[[], float] | None = None,
        pictures: Collection[str] = (),
        camera: str | None = None,
        frame: int | None = None,
        time_s: float | None = None,
    ) -> FrameResult:
        """Process one frame (height, width, 3) BGR. clock: seconds, to time the stages, without drawing."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if size != self.context.image_size:
            raise BadInput(
                f"The image is {size}; these stages are set up for {self.context.image_size}.",
                "Set them up for this size.",
                reason="size-mismatch",
            )
        state, took, drawn = FrameState.of(pixels), {}, {}
        for stage in self._stages:
            began = clock() if clock else 0.0
            state = stage.run(state)
            if clock:
                took[stage.NAME] = 1000 * (clock() - began)
            if stage.NAME in pictures:
                drawn[stage.NAME] = stage.picture(state)
        return FrameResult(
            Detections(state.found, size, camera, frame, time_s), took, drawn, state.notes
        )


def stage_of(view: str) -> str | None:
    """Return the stage whose picture a view is; None for the view of all detections."""
    return view.removeprefix(STAGE) if view.startswith(STAGE) else None
