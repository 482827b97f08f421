"""A pipeline of stages: frame in, detections out, with each stage's picture and time if asked.

    config = StageConfig.from_json({"name": "ssl", "title": …, "stages": [{"stage": "colours", "follow": true}, …]})
    pipeline = StagePipeline(config, context)
    result = pipeline.process(pixels, clock=time.perf_counter, pictures=("colours",))

A pipeline belongs to one camera at one size, and keeps its stages' state; one thread at a time.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.detections import Detections
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.options import read_options
from touchline.vision.stages import STAGES, FrameState, Stage, StageContext

MAX_STAGES = 20
_FORM = 'Send {"name", "title", "stages": [{"stage": NAME, OPTION: VALUE, …}, …]}, and optionally "corrected": true.'
# What a stage reads that another one writes.
_AFTER = {"blobs": "colours", "butterfly": "blobs", "tags": "blobs", "markers": "blobs", "ball": "blobs"}


@dataclass(frozen=True)
class StageConfig:
    """Stages in order with their options, read and checked. corrected: they look at the corrected picture."""

    name: str
    title: str
    stages: tuple[tuple[str, Mapping[str, Any]], ...]
    corrected: bool = False

    @classmethod
    def from_json(cls, value: Any) -> Self:
        if not isinstance(value, Mapping) or set(value) - {"corrected"} != {"name", "title", "stages"}:
            raise BadInput("This is not a plan of stages.", _FORM, reason="bad-stages")
        listed, corrected = value["stages"], value.get("corrected", False)
        if not isinstance(corrected, bool):
            raise BadInput("The value of corrected in the plan must be true or false.", _FORM, reason="bad-stages")
        if not isinstance(listed, (list, tuple)) or not 0 < len(listed) <= MAX_STAGES:
            raise BadInput(f"A plan must have 1 to {MAX_STAGES} stages.", _FORM, reason="bad-stages")
        name, title = value["name"], value["title"]
        if not all(isinstance(text, str) and 0 < len(text) <= 80 and text.isprintable() for text in (name, title)):
            raise BadInput("The plan of stages needs a name and a title.", _FORM, reason="bad-stages")
        stages: list[tuple[str, Mapping[str, Any]]] = []
        for entry in listed:
            if not isinstance(entry, Mapping) or not isinstance(entry.get("stage"), str):
                raise BadInput("An entry of the plan names no stage.", _FORM, reason="bad-stages")
            stage = entry["stage"]
            options = read_options(STAGES[stage].OPTIONS, {k: v for k, v in entry.items() if k != "stage"})
            needed, before = _AFTER.get(stage), [done for done, _ in stages]
            if stage in before or (needed and needed not in before):
                raise BadInput(f"The stage {stage} is in the wrong position.",
                               f"List it once, after {needed}." if needed else "List it once.", reason="bad-stages")
            stages.append((stage, options))
        return cls(name, title, tuple(stages), corrected)

    def to_json(self) -> dict[str, Any]:
        return {"name": self.name, "title": self.title, **({"corrected": True} if self.corrected else {}), "stages": [
            {"stage": name, **{k: list(v) if isinstance(v, tuple) else v for k, v in options.items()}}
            for name, options in self.stages]}


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
        self._stages: list[Stage] = [STAGES[name](options, context) for name, options in config.stages]

    def process(self, pixels: NDArray[np.uint8], *, clock: Callable[[], float] | None = None,
                pictures: Collection[str] = (), camera: str | None = None, frame: int | None = None,
                time_s: float | None = None) -> FrameResult:
        """Process one frame (height, width, 3) BGR. clock: seconds, to time the stages, without drawing."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if size != self.context.image_size:
            raise BadInput(f"The image is {size}; these stages are set up for {self.context.image_size}.",
                           "Set them up for this size.", reason="size-mismatch")
        state, took, drawn = FrameState.of(pixels), {}, {}
        for stage in self._stages:
            began = clock() if clock else 0.0
            state = stage.run(state)
            if clock:
                took[stage.NAME] = 1000 * (clock() - began)
            if stage.NAME in pictures:
                drawn[stage.NAME] = stage.picture(state)
        return FrameResult(Detections(state.found, size, camera, frame, time_s), took, drawn, state.notes)
