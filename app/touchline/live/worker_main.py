"""The process of one camera: reads, corrects, encodes, runs the parts of capabilities, and reports how it goes."""

import contextlib
import threading
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.field_json import field_from_json
from touchline.core.records import Calibration
from touchline.core.registry import load
from touchline.core.statements import say
from touchline.images import ImageLimits, decode_in_process, read_in_process
from touchline.live import messages
from touchline.live.camera_part import CameraPart, PartContext, Request
from touchline.live.capture import REST_S, FrameCapture
from touchline.live.encoder import Encoder
from touchline.live.failures import Failures
from touchline.live.picture import AppliedCalibration
from touchline.live.quality_monitor import QualityMonitor
from touchline.live.snapshot import take_still
from touchline.live.status_types import ProcessValues
from touchline.live.stream_spec import StreamSpec
from touchline.processes.framing import START, Connection, answer, decode_body, encode_body
from touchline.sources import SourceContext

STATUS_S = 0.2


def main(connection: Connection, arguments: dict[str, Any]) -> None:
    """Serve until the server goes. arguments: {"source", "fields", "pictures", "hosts", "limits", "parts"}."""
    for target in arguments.get("parts", ()):
        with contextlib.suppress(Exception):  # imported before the server counts the seconds; refused below
            load(target)
    connection.send(START, 0, encode_body({}))
    CameraWorker(connection, arguments).run()


class CameraWorker:
    """One connection, one source."""

    def __init__(self, connection: Connection, arguments: dict[str, Any]) -> None:
        limits = ImageLimits(**arguments["limits"])
        context = SourceContext({name: field_from_json(one) for name, one in arguments["fields"].items()},
                                lambda data: decode_in_process(data, limits),
                                Path(arguments["pictures"]) if arguments["pictures"] else None,
                                tuple(arguments["hosts"]), lambda data: read_in_process(data, limits))
        self._connection = connection
        self._capture = FrameCapture(arguments["source"], context)
        self._failures = Failures()
        self._encoder = Encoder(self._capture, connection.send, self._failures)
        self._quality = QualityMonitor(self._capture, self._encoder, self._failures)
        self._parts: dict[int, CameraPart] = {}  # by their number in the list that both sides have
        for number, target in enumerate(arguments.get("parts", ())):
            around = PartContext(self._capture, partial(connection.send, messages.FEED, number),
                                 partial(connection.send, messages.PICTURE), self._failures, limits)
            with self._surviving(target):
                self._parts[number] = load(target)(around)
        self._requests: dict[str, Request] = {
            "still": lambda r: take_still(self._capture, r["frames"], r["over_s"], r["timeout_s"]),
            "controls": lambda r: ({"controls": [asdict(c) for c in self._capture.controls()]}, b""),
            "set": lambda r: ({"control": asdict(self._capture.set_control(r["name"], r["value"]))}, b""),
        }
        for part in self._parts.values():
            self._requests.update(part.requests)

    def run(self) -> None:
        threads = (run for part in self._parts.values() for run in part.threads)
        for run in (self._capture.run, self._encoder.run, self._quality.run, *threads, self._report):
            threading.Thread(target=run, name=run.__qualname__, daemon=True).start()
        while True:
            kind, number, body = self._connection.receive()
            head, _ = decode_body(body)
            if kind == messages.STREAMS:
                self._watch(head["streams"])
            elif kind == messages.CALIBRATE:
                calibration = head["calibration"] and AppliedCalibration.of(Calibration.from_json(head["calibration"]))
                self._encoder.apply(calibration)
                for part in self._parts.values():
                    with self._surviving(part):
                        part.apply(calibration, head["picture"])
            elif kind == messages.FOLLOW:
                if (followed := self._parts.get(head["part"])) is not None:
                    with self._surviving(followed):
                        followed.follow(head["settings"])
            elif kind == messages.REQUEST:
                threading.Thread(target=answer, args=(self._connection, number, lambda head=head: self._perform(head)),
                                 daemon=True).start()

    def _surviving(self, part: CameraPart | str) -> contextlib.AbstractContextManager[None]:
        """Return a context in which a part may fail: the picture goes on."""
        return self._failures.surviving(say("camera-failure.part", "The part {part} of the camera process failed",
                                            part=part if isinstance(part, str) else type(part).__name__))

    def _watch(self, given: list[dict[str, Any]]) -> None:
        streams = {one["number"]: (StreamSpec(**one["spec"]), one["interval_s"]) for one in given}
        of_parts = {number: one for number, one in streams.items() if one[0].is_of_part}
        self._encoder.watch({number: one for number, one in streams.items() if number not in of_parts})
        for part in self._parts.values():
            with self._surviving(part):
                part.watch(of_parts)
        self._capture.watch(min((interval_s for _, interval_s in streams.values()), default=REST_S))

    def _report(self) -> None:
        with contextlib.suppress(OSError):  # the server is gone
            while True:
                status: ProcessValues = {
                    **self._capture.status(), "encoded": self._encoder.encoded, "quality": self._quality.newest,
                    "failures": self._failures.to_json()}
                for part in self._parts.values():
                    with self._surviving(part):
                        status |= part.status()  # type: ignore[typeddict-item]
                self._connection.send(messages.STATUS, 0, encode_body(status))
                time.sleep(STATUS_S)

    def _perform(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Return the answer to a request, JSON and payload."""
        try:
            return self._requests[request["what"]](request)
        except MemoryError:
            raise BadInput(say("camera.process-memory", "The camera process does not have enough memory for this."),
                           say("camera.fewer-frames", "Request fewer frames."), reason="camera-memory") from None
