"""The process of one camera: reads, corrects, encodes, runs the parts of capabilities, and reports how it goes.

Light and focus are looked at about twice a second, on a reduced picture. Flicker needs frames that follow each other:
every FLICKER_EVERY_S a burst of them is looked at, rows only.
"""

import contextlib
import threading
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import BadInput
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize, inside_picture
from touchline.core.records import Calibration
from touchline.core.registry import load
from touchline.core.statements import say
from touchline.images import ImageLimits, decode_in_process, read_in_process
from touchline.live import messages
from touchline.live.camera_part import CameraPart, PartContext, Request
from touchline.live.capture import REST_S, CapturedFrame, FrameCapture, take_still
from touchline.live.failures import Failures
from touchline.live.messages import PictureQuality, ProcessValues, StreamSpec
from touchline.live.picture import AppliedCalibration, Encoder
from touchline.processes.framing import START, Connection, answer, decode_body, encode_body
from touchline.sources import SourceContext
from touchline.vision import flicker, light, sharpness
from touchline.vision.picture_print import PicturePrint
from touchline.vision.zones import Stillness

EVERY_S = 0.5
FLICKER_EVERY_S = 8.0
BURST = 32  # frames, about a second of them
BURST_S = 4.0  # a slow camera's burst ends here, whatever it has
WIDTH_PX = 640
STATUS_S = 0.2


class QualityMonitor:
    """The thread that looks at light and focus. It gives way: it sleeps much longer than it works."""

    def __init__(self, capture: FrameCapture, encoder: Encoder, failures: Failures) -> None:
        self._capture = capture
        self._encoder = encoder
        self._failures = failures
        self._stillness = Stillness()
        self._flicker: flicker.Flicker | None = None
        self._mask: tuple[str, ImageSize, NDArray[np.bool_]] | None = None
        self.newest: PictureQuality | None = None

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        seq, due = 0, time.monotonic()
        while True:
            with self._failures.surviving(
                say("camera-failure.quality", "Light and focus are not evaluated")
            ):
                if time.monotonic() >= due and not self._capture.resting:
                    due = time.monotonic() + FLICKER_EVERY_S
                    self._flicker = self._burst(seq) or self._flicker
                taken = self._capture.after(seq, EVERY_S, in_passing=True)
                if taken is not None:
                    seq = taken.seq
                    self.newest = self._look(
                        opencv.shrink_to_width(taken.frame.pixels, WIDTH_PX), taken
                    )
            time.sleep(EVERY_S)

    def _look(self, small: NDArray[np.uint8], taken: CapturedFrame) -> PictureQuality:
        still = self._stillness.add(small, taken.moment)
        field = self._field_of(small.shape[1], small.shape[0], taken.frame.size)
        found_light = light.measure_light(small, field)
        # reduced, a soft edge looks sharp
        found_sharpness = sharpness.measure_sharpness(taken.frame.pixels, field)
        words = [
            *light.advice(found_light),
            *sharpness.advice(found_sharpness),
            *flicker.advice(self._flicker),
        ]
        words.sort(key=lambda word: word["severity"] != "warning")
        found_print = PicturePrint.of(small)
        return {
            "still": still,
            "light": found_light.to_json(),
            "sharpness": found_sharpness.to_json(),
            "words": words,
            "flicker": self._flicker,
            "print": None if found_print is None else found_print.to_text(),
        }

    def _burst(self, seq: int) -> flicker.Flicker | None:
        times, rows = list[float](), list[NDArray[np.float32]]()
        end = time.monotonic() + BURST_S
        while len(times) < BURST and time.monotonic() < end:
            taken = self._capture.after(seq, EVERY_S, in_passing=True)
            if taken is None:
                break
            seq = taken.seq
            row = flicker.row_means(taken.frame.reduced(1, flicker.MAX_ROWS))
            if rows and len(row) != len(rows[0]):
                break
            times.append(taken.moment)
            rows.append(row)
        return flicker.measure_flicker(times, rows)

    def _field_of(self, width: int, height: int, raw: ImageSize) -> NDArray[np.bool_] | None:
        """Return where the field lies in the reduced picture; None where no calibration says."""
        applied = self._encoder.calibration
        if applied is None or applied.record.image_size != raw:
            return None
        if self._mask is None or self._mask[:2] != (applied.record.id, raw):
            x, y = np.meshgrid(np.arange(width), np.arange(height))
            points = np.stack(
                [(x + 0.5) * raw.width / width - 0.5, (y + 0.5) * raw.height / height - 0.5],
                axis=-1,
            )
            corrected = applied.model.corrected_from_raw(points.reshape(-1, 2)).reshape(
                height, width, 2
            )
            self._mask = (
                applied.record.id,
                raw,
                inside_picture(corrected, applied.model.corrected_size, 0),
            )
        return self._mask[2]


def main(connection: Connection, arguments: dict[str, Any]) -> None:
    """Serve until the server goes. arguments: {"source", "fields", "pictures", "hosts", "limits", "parts"}."""
    for target in arguments.get("parts", ()):
        # imported before the server counts the seconds; refused below
        with contextlib.suppress(Exception):
            load(target)
    connection.send(START, 0, encode_body({}))
    CameraWorker(connection, arguments).run()


class CameraWorker:
    """One connection, one source."""

    def __init__(self, connection: Connection, arguments: dict[str, Any]) -> None:
        limits = ImageLimits(**arguments["limits"])
        context = SourceContext(
            {name: field_from_json(one) for name, one in arguments["fields"].items()},
            lambda data: decode_in_process(data, limits),
            Path(arguments["pictures"]) if arguments["pictures"] else None,
            tuple(arguments["hosts"]),
            lambda data: read_in_process(data, limits),
        )
        self._connection = connection
        self._capture = FrameCapture(arguments["source"], context)
        self._failures = Failures()
        self._encoder = Encoder(self._capture, connection.send, self._failures)
        self._quality = QualityMonitor(self._capture, self._encoder, self._failures)
        self._parts: dict[int, CameraPart] = {}  # by their number in the list that both sides have
        for number, target in enumerate(arguments.get("parts", ())):
            around = PartContext(
                self._capture,
                partial(connection.send, messages.FEED, number),
                partial(connection.send, messages.PICTURE),
                self._failures,
                limits,
            )
            with self._surviving(target):
                self._parts[number] = load(target)(around)
        self._requests: dict[str, Request] = {
            "still": lambda r: take_still(self._capture, r["frames"], r["over_s"], r["timeout_s"]),
            "controls": lambda r: (
                {"controls": [asdict(c) for c in self._capture.controls()]},
                b"",
            ),
            "set": lambda r: (
                {"control": asdict(self._capture.set_control(r["name"], r["value"]))},
                b"",
            ),
        }
        for part in self._parts.values():
            self._requests.update(part.requests)

    def run(self) -> None:
        threads = (run for part in self._parts.values() for run in part.threads)
        for run in (
            self._capture.run,
            self._encoder.run,
            self._quality.run,
            *threads,
            self._report,
        ):
            threading.Thread(target=run, name=run.__qualname__, daemon=True).start()
        while True:
            kind, number, body = self._connection.receive()
            head, _ = decode_body(body)
            if kind == messages.STREAMS:
                self._watch(head["streams"])
            elif kind == messages.CALIBRATE:
                calibration = head["calibration"] and AppliedCalibration.of(
                    Calibration.from_json(head["calibration"])
                )
                self._encoder.apply(calibration)
                for part in self._parts.values():
                    with self._surviving(part):
                        part.apply(calibration, head["picture"])
            elif kind == messages.FOLLOW:
                if (followed := self._parts.get(head["part"])) is not None:
                    with self._surviving(followed):
                        followed.follow(head["settings"])
            elif kind == messages.REQUEST:
                threading.Thread(
                    target=answer,
                    args=(self._connection, number, lambda head=head: self._perform(head)),
                    daemon=True,
                ).start()

    def _surviving(self, part: CameraPart | str) -> contextlib.AbstractContextManager[None]:
        """Return a context in which a part may fail: the picture goes on."""
        return self._failures.surviving(
            say(
                "camera-failure.part",
                "The part {part} of the camera process failed",
                part=part if isinstance(part, str) else type(part).__name__,
            )
        )

    def _watch(self, given: list[dict[str, Any]]) -> None:
        streams = {one["number"]: (StreamSpec(**one["spec"]), one["interval_s"]) for one in given}
        of_parts = {number: one for number, one in streams.items() if one[0].is_of_part}
        self._encoder.watch(
            {number: one for number, one in streams.items() if number not in of_parts}
        )
        for part in self._parts.values():
            with self._surviving(part):
                part.watch(of_parts)
        self._capture.watch(min((interval_s for _, interval_s in streams.values()), default=REST_S))

    def _report(self) -> None:
        with contextlib.suppress(OSError):  # the server is gone
            while True:
                status: ProcessValues = {
                    **self._capture.status(),
                    "encoded": self._encoder.encoded,
                    "quality": self._quality.newest,
                    "failures": self._failures.to_json(),
                }
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
            raise BadInput(
                say(
                    "camera.process-memory",
                    "The camera process does not have enough memory for this.",
                ),
                say("camera.fewer-frames", "Request fewer frames."),
                reason="camera-memory",
            ) from None
