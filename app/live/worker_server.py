"""In a camera's process: what the server asks for, done."""

import threading
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.core.errors import BadInput, TouchlineError
from app.core.field_json import field_from_json
from app.core.geometry import ImageSize
from app.core.records import Calibration
from app.images import ImageLimits, decode_in_process
from app.live import messages
from app.live.board_capture import find_board
from app.live.capture import FrameCapture
from app.live.detector import LiveDetector
from app.live.drift import CameraDriftMonitor
from app.live.encoder import Encoder
from app.live.frame_buffer import FrameBuffer
from app.live.picture import AppliedCalibration
from app.live.quality_monitor import QualityMonitor
from app.live.rolls import RollMonitor
from app.live.snapshot import take_still
from app.live.stream_spec import StreamSpec
from app.live.worker_main import STATUS_S, Line, every
from app.sources import SourceContext


class Serving:
    """One line, one source."""

    def __init__(self, line: Line) -> None:
        self._line = line
        line.send(messages.READY, 0, messages.message({}))
        kind, _, body = line.receive()
        if kind != messages.OPEN:
            raise RuntimeError("the server began with something else")
        spec = messages.parts(body)[0]
        self._capture = FrameCapture(spec["source"], _surroundings(spec))
        self._encoder = Encoder(self._capture, line.send)
        self._inspector = QualityMonitor(self._capture, self._encoder)
        self._drift = CameraDriftMonitor(self._capture, ImageLimits(**spec["limits"]))
        self._rolls = RollMonitor(self._capture)
        self._seeing = LiveDetector(self._capture, line.send)
        self._ring = FrameBuffer(self._capture)

    def run(self) -> None:
        for part in (self._capture, self._encoder, self._inspector, self._drift, self._seeing,
                     self._ring):
            part.start()
        every(STATUS_S, self._tell)
        while True:
            kind, number, body = self._line.receive()
            head = messages.parts(body)[0]
            if kind == messages.STREAMS:
                channels = {one["number"]: (StreamSpec(**one["channel"]), one["interval_s"])
                            for one in head["channels"]}
                self._encoder.watch({n: one for n, one in channels.items() if not one[0].is_detection})
                self._seeing.watch({n: one for n, one in channels.items() if one[0].is_detection})
                self._ring.keep(any(channel.is_detection for channel, _ in channels.values()))
                self._capture.watch(bool(head["channels"]))
            elif kind == messages.CALIBRATE:
                shown = _shown(head["calibration"])
                self._encoder.show(shown)
                self._drift.show(shown, head["picture"])
                self._seeing.show(shown)
            elif kind == messages.DETECT:
                self._seeing.follow(head)
            elif kind == messages.REQUEST:
                threading.Thread(target=self._answer, args=(number, head), daemon=True).start()

    def _tell(self) -> None:
        told = self._capture.status() | {"encoded": self._encoder.encoded, "inspected": self._inspector.newest,
                                         "drift": self._drift.newest, "seeing": self._seeing.told}
        self._line.send(messages.STATUS, 0, messages.message(told))

    def _answer(self, number: int, asked: dict[str, Any]) -> None:
        deeds: dict[str, Callable[[dict[str, Any]], tuple[dict[str, Any], bytes]]] = {
            "still": lambda a: take_still(self._capture, a["frames"], a["over_s"], a["timeout_s"]),
            "board": lambda a: (find_board(self._capture, a["board"], a["after"]), b""),
            "rolls": lambda a: (self._rolls.ask(a["watch"], a["after"], a["seq"]), b""),
            "clip": lambda a: self._ring.clip(a["seconds"]),
            "controls": lambda a: ({"controls": [asdict(c) for c in self._capture.controls()]}, b""),
            "set": lambda a: ({"control": asdict(self._capture.set_control(a["name"], a["value"]))}, b""),
        }
        try:
            head, payload = deeds[asked["what"]](asked)
        except TouchlineError as error:
            head, payload = {"problem": problem_of(error)}, b""
        except MemoryError:
            head, payload = {"problem": problem_of(BadInput("The camera's process has not enough memory for this.",
                                                            "Ask for fewer frames.", reason="camera-memory"))}, b""
        self._line.send(messages.ANSWER, number, messages.message(head, payload))


def problem_of(error: TouchlineError) -> dict[str, Any]:
    return {"kind": type(error).__name__, "what": error.what, "fix": error.fix, "reason": error.reason}


def _surroundings(spec: dict[str, Any]) -> SourceContext:
    limits = ImageLimits(**spec["limits"])
    fields = {name: field_from_json(one) for name, one in spec["fields"].items()}
    pictures = Path(spec["pictures"]) if spec["pictures"] else None
    return SourceContext(fields, lambda data: decode_in_process(data, limits), pictures, tuple(spec["hosts"]),
                        tuple(Path(place) for place in spec["producers"]))


def _shown(calibration: dict[str, Any] | None) -> AppliedCalibration | None:
    if calibration is None:
        return None
    record = Calibration.from_json(calibration)
    assert isinstance(record.image_size, ImageSize)
    return AppliedCalibration.of(record)
