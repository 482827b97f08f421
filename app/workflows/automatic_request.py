"""One calibration without clicks, the same for every door: what it rests on, and what came of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as member
from typing import Any, Self

import numpy as np

from app.core.errors import BadInput, Conflict, FitFailed
from app.core.field import Field, Region
from app.core.field_json import field_from_json
from app.core.progress import Progress, no_progress
from app.core.records import Calibration, Frame
from app.evaluate.fit.verification import verdict_of
from app.fitting.field_lines.search import Rough
from app.images import ImageDecoder
from app.models import MODELS
from app.store.snapshots import checked_bytes
from app.vision.motion.background import Background
from app.workflows import automatic
from app.workflows.calibration import Calibrated, part_of
from app.workflows.calibration_request import Task

AUTO = "auto"
LADDER = ("brown-conrady", "fisheye", "division")  # the first that can be fitted: very wide lenses need the second
ROUGH_KEYS = {"height_mm": (100.0, 100_000.0), "turn_deg": (-360.0, 360.0)}


def rough_from(value: Mapping[str, Any] | None) -> Rough:
    """{"height_mm", "turn_deg"}, each if known; refused where it is neither."""
    for name, number in (value or {}).items():
        if name not in ROUGH_KEYS:
            raise BadInput(f"Nothing rough is called {name!r}.", f"Give {' or '.join(ROUGH_KEYS)}.",
                           reason="bad-rough")
        low, high = ROUGH_KEYS[name]
        if isinstance(number, bool) or not isinstance(number, (int, float)) or not low <= number <= high:
            raise BadInput(f"The rough {name} cannot be {number!r}.", f"Give a number from {low:g} to {high:g}.",
                           reason="bad-rough")
    return Rough(**(value or {}))


@dataclass(frozen=True, eq=False)
class AutoTask:
    """Where to look, and what for."""

    field: Field
    region: Region
    model: str = AUTO
    options: Mapping[str, Any] = member(default_factory=dict)
    rough: Mapping[str, Any] = member(default_factory=dict)
    camera: str | None = None
    snapshot: str | None = None
    note: str = ""

    def __post_init__(self) -> None:
        for name in self.models:
            MODELS[name]
        rough_from(self.rough)

    @property
    def models(self) -> tuple[str, ...]:
        return LADDER if self.model == AUTO else (self.model,)

    def to_json(self) -> dict[str, Any]:
        return {"field": self.field.to_json(), "region": self.region.name, "rotate": self.region.rotate_deg,
                "model": self.model, "options": dict(self.options), "rough": dict(self.rough), "camera": self.camera,
                "snapshot": self.snapshot, "note": self.note}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        field = field_from_json(value["field"])
        return cls(field, field.region(value["region"], value["rotate"]), value["model"], value["options"],
                   value["rough"], value["camera"], value["snapshot"], value["note"])

    def answer(self, frame: Frame, progress: Progress = no_progress) -> tuple[dict[str, Any], Calibration | None]:
        """What was found and how sure it is; and the calibration where nothing speaks against it.

        A picture in which nothing is found is an answer as well: what was seen, what is lacking, and the points.
        """
        progress(0.0, "Looking for lines")
        seen = automatic.look(frame.pixels)
        found, searched = automatic.find(seen, self.field, self.region, rough_from(self.rough),
                                             part_of(progress, 0.15, 0.6))
        told: dict[str, Any] = {
            "field": self.field.name, "region": self.region.name, "rotate": self.region.rotate_deg,
            "model": self.model, "image_size": list(frame.size),
            "candidates": automatic.candidates_json(searched, self.region),
            "lines": seen.shown(), "observations": [], "proof": None, "report": None}
        if found is None:
            refusal = automatic.nothing_seen(seen, searched)
            return {**told, "doubts": [_doubt(refusal)], "verdict": verdict_of([_doubt(refusal)], None, None)}, None
        told["observations"] = [o.to_json() for o in found.observations]
        proof = automatic.proof_of(found, seen, self.field, self.region)
        doubts, done, refused = [*proof.doubts()], None, []
        for name in self.models:
            try:
                done = automatic.calibrated(found, self.field, self.region, frame.size, name, self.options,
                                                part_of(progress, 0.6, 1.0))
                told["model"] = name
                break
            except FitFailed as refusal:
                refused.append(_doubt(refusal))
        report = None if done is None else done.report
        doubts += refused[:1] if done is None else []
        told |= {"doubts": doubts, "verdict": verdict_of(doubts, proof, report and report["verdict"]),
                 "proof": proof.to_json(), "report": report}
        return told, self._record(found, done, frame, told["model"]) if done is not None and not doubts else None

    def _record(self, found: automatic.Found, done: Calibrated, frame: Frame, model: str) -> Calibration:
        task = Task(found.observations, self.field, self.region, frame.size, model, self.options, self.camera,
                    self.snapshot, frame.sha256 or None, self.note)
        return task.record(done)


def _doubt(refusal: FitFailed) -> dict[str, str]:
    return {"reason": refusal.reason, "what": refusal.what, "fix": refusal.fix}


def one_picture(reads: Sequence[Callable[[], Frame]], progress: Progress = no_progress) -> Frame:
    """Of several pictures of one camera, what stays while robots and people move; the only one as it is."""
    first = reads[0]()
    if len(reads) == 1:
        return first
    background = Background(first.pixels.shape, len(reads))
    for number, read in enumerate(reads):
        progress(number / len(reads), f"Reading picture {number + 1} of {len(reads)}")
        frame = first if number == 0 else read()
        if frame.size != first.size:
            raise Conflict(f"Picture {number + 1} is {frame.size.width} × {frame.size.height} px, the first "
                           f"{first.size.width} × {first.size.height} px.", "Give pictures of one camera in one mode.",
                           reason="size-mismatch")
        background.add(frame.pixels)
    return replace(first, pixels=np.ascontiguousarray(background.picture))


def run_auto(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"task", "pictures": [{"name", "path", "sha256"}, …], "keep"}; they are a stranger's, decoded as such."""
    task = AutoTask.from_json(spec["task"])
    with ImageDecoder(workers=1) as decoder:
        reads = [lambda p=p: decoder.frame_from_bytes(checked_bytes(**p)) for p in spec["pictures"]]
        frame = one_picture(reads, part_of(progress, 0.0, 0.1))
    told, made = task.answer(frame, part_of(progress, 0.1, 1.0))
    return {"told": told, "made": made.to_json() if made is not None and spec["keep"] else None}


__all__ = ["AutoTask", "one_picture", "rough_from", "run_auto"]
