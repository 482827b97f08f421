"""In a camera's process: each second, whether the camera still stands as it did when it was calibrated.

What the lines looked like comes from the calibration's own picture, so that a knock before it was activated, or while
the server was off, is seen too; where there is none, or none that shows them, from the first seconds after activation.
"""

import contextlib
import threading
import time
from typing import Literal, NamedTuple

import numpy as np

from touchline.core.drift_status import CameraDrift
from touchline.core.errors import BadImage, TouchlineError
from touchline.core.geometry import Pixels
from touchline.core.json_values import JsonObject
from touchline.core.statements import say, sentence_in
from touchline.drift.alarm import DriftWatch
from touchline.drift.check import verdict_in
from touchline.evaluate.field_lines.motion import LineReference, MotionSample
from touchline.evaluate.verdict import level_of
from touchline.images import decode_in_process
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.picture import AppliedCalibration
from touchline.processes.limits import give_way
from touchline.store.files import read_checked

LOOK_S = 1.0  # between looks
DOUBTFUL_LOOK_S = 0.35  # likewise, in doubt: an alarm comes two looks after the knock
WAIT_S = 0.5  # for a frame
LEARN_S, LEARN_FRAMES = 0.5, 5  # between the frames that are learnt from
RETRY_S, MAX_RETRY_S = 5.0, 60.0  # where no lines were found to follow
NICE = 10  # niceness: the picture goes first

Source = Literal["calibration", "start"]  # of what lines looked like


class DriftPart(CameraPart):
    """The thread that looks at the lines. It gives way: it sleeps much longer than it works."""

    def __init__(self, around: PartContext) -> None:
        self._capture = around.capture
        self._failures = around.failures
        self._limits = around.limits
        self.threads = (self.run,)
        self._target: tuple[AppliedCalibration, JsonObject | None] | None = None
        self._changed = threading.Event()
        self.newest: CameraDrift | None = None
        self._look: _Look | None = None
        self.requests = {"displacement": lambda _request: (self.displacement(), b"")}

    def displacement(self) -> JsonObject:
        """Return how far each place of the lines has moved, plain JSON; empty where that was not measured."""
        look = self._look
        return {} if look is None else look.to_json()

    def apply(self, calibration: AppliedCalibration | None, picture: JsonObject | None) -> None:
        """Follow this calibration's lines from now on. picture: {"name", "path", "sha256"} of the one it came from."""
        before = self._target
        if (
            calibration is not None
            and before is not None
            and before[0].record.id == calibration.record.id
        ):
            return  # the same again, as after a cable was out: what is known of it holds
        self._target = None if calibration is None else (calibration, picture)
        self.newest = self._look = None
        self._changed.set()

    def status(self) -> JsonObject:
        return {"drift": self.newest}

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        give_way(NICE)
        while True:
            self._changed.wait()
            self._changed.clear()
            if (target := self._target) is not None:
                with self._failures.surviving(
                    say("camera-failure.drift", "The camera is not monitored for drift")
                ):
                    self._follow(target)
                    continue
                self.newest = None
                if not self._changed.wait(RETRY_S):
                    self._changed.set()

    def _follow(self, target: tuple[AppliedCalibration, JsonObject | None]) -> None:
        """Follow the lines until something else is to be followed."""
        applied, picture = target
        watch, calibration, seq = DriftWatch(time.time()), applied.record, 0

        def report(source: Source | None, took_s: float = 0.0) -> None:
            if self._target is target:
                self.newest = {
                    **watch.status.to_json(),
                    "calibration": calibration.id,
                    "reference": source,
                    "took_ms": round(1000 * took_s, 1),
                }

        report(None)
        reference = self._reference_in(applied, picture)
        source: Source = "calibration" if reference is not None else "start"
        again_s = RETRY_S
        while reference is None:
            if (reference := self._learn(applied)) is None:
                watch.unfollowed(time.time())
                report(None)
                if self._changed.wait(again_s):
                    return
                again_s = min(2 * again_s, MAX_RETRY_S)
        watch.misplaced(reference.misplaced, reference.doubt)
        sample: MotionSample | None = None
        while not self._changed.is_set():
            taken = self._capture.after(seq, WAIT_S, in_passing=True)
            if taken is not None and taken.frame.size == reference.lines.size:
                seq, begun = taken.seq, time.thread_time()
                with contextlib.suppress(BadImage):  # the next one is whole again
                    sample = reference.lines.look(taken.frame.pixels, sample)
                    watch.add(sample, taken.time)
                    report(source, time.thread_time() - begun)
                    self._note(target, _Look(calibration.id, taken.time, reference.lines, sample))
            self._changed.wait(DOUBTFUL_LOOK_S if watch.doubtful else LOOK_S)

    def _note(self, target: tuple[AppliedCalibration, JsonObject | None], look: "_Look") -> None:
        if self._target is target:
            self._look = look

    def _reference_in(
        self, applied: AppliedCalibration, picture: JsonObject | None
    ) -> "_Reference | None":
        if picture is None:
            return None
        try:
            frame = decode_in_process(read_checked(**picture), self._limits)
        except TouchlineError:
            return None
        return _reference([frame.pixels], applied)

    def _learn(self, applied: AppliedCalibration) -> "_Reference | None":
        """Learn a reference from some frames, in which what moves is not in the same place."""
        pictures: list[Pixels] = []
        seq = 0
        while len(pictures) < LEARN_FRAMES:
            if (taken := self._capture.after(seq, WAIT_S, in_passing=True)) is not None:
                seq = taken.seq
                if pictures and pictures[0].shape != taken.frame.pixels.shape:
                    pictures = []
                pictures.append(taken.frame.pixels)
            if self._changed.wait(LEARN_S):
                return None
        return _reference(pictures, applied)


class _Look(NamedTuple):
    """The newest look: at which calibration's lines, when (unix, s), and what it found."""

    calibration: str
    at: float
    lines: LineReference
    sample: MotionSample

    def to_json(self) -> JsonObject:
        return {
            "calibration": self.calibration,
            "at": round(self.at, 3),
            "image_size": list(self.lines.size),
            "places": [
                {
                    "was": place.round(2).tolist(),
                    "now": (place + shift).round(3).tolist(),
                    "mm": round(float(mm), 3),
                    "level": level_of(float(mm)),
                }
                for place, shift, mm in zip(
                    self.sample.places,
                    self.sample.shifts,
                    self.lines.displacements_mm(self.sample),
                    strict=True,
                )
                if np.isfinite(mm)
            ],
        }


class _Reference(NamedTuple):
    """The lines that are followed, and in a sentence how far the calibration is from them.

    misplaced: where it is wrong, doubt: where it is only fair; else empty.
    """

    lines: LineReference
    misplaced: str
    doubt: str


def _reference(pictures: list[Pixels], applied: AppliedCalibration) -> _Reference | None:
    height, width = pictures[0].shape[:2]
    if (width, height) != tuple(applied.record.image_size):
        return None
    try:
        if (
            lines := LineReference.of(pictures, applied.model, applied.field, applied.region)
        ) is None:
            return None
        verdict = verdict_in(pictures[0], applied.record)
    except (TouchlineError, np.linalg.LinAlgError):
        return None
    sentence, level = sentence_in(verdict, "sentence"), verdict["lines_level"]
    return _Reference(
        lines, sentence if level == "poor" else "", sentence if level == "fair" else ""
    )
