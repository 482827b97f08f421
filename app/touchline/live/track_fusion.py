"""The tracks of a rig, live: its cameras' detections fused while somebody listens."""

import asyncio
import contextlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from touchline.core.common_sentences import NOT_CALIBRATED, OPEN_AGAIN, SENDS_NO_FRAMES
from touchline.core.detections import Detection
from touchline.core.errors import TouchlineError, Unavailable
from touchline.core.statements import say
from touchline.evaluate.motion.object_tracks import ObjectTracker, seams_of
from touchline.live.camera import LiveCamera
from touchline.live.streams import Viewer
from touchline.processes.framing import decode_body

INPUT_FPS = 20.0  # of each camera that go in: the server's own thread reads them
INTERVAL_S = 0.05
RETRY_S = 1.0  # after a camera that cannot be listened to
SILENT_S = 5.0


class TrackFusion:
    """The tracks of one rig. Only for the event loop's own thread. camera: by its name, started; raises why not."""

    def __init__(self, names: Sequence[str], camera: Callable[[str], LiveCamera]) -> None:
        self.names = tuple(names)
        self._camera = camera
        self._viewers: set[Viewer] = set()
        self._tasks: list[asyncio.Task[None]] = []
        self._tracker = ObjectTracker()
        self._received_s: dict[str, float] = {}
        self._problems: dict[str, TouchlineError] = {}

    @contextlib.contextmanager
    def listening(self) -> Iterator[Viewer]:
        """Yield a viewer of JSON texts; nothing is followed when nobody listens."""
        viewer = Viewer()
        self._viewers.add(viewer)
        if not self._tasks:
            self._tracker = ObjectTracker()
            self._tasks = [asyncio.create_task(self._follow(name)) for name in self.names]
            self._tasks.append(asyncio.create_task(self._send()))
        try:
            yield viewer
        finally:
            self._viewers.discard(viewer)
            if not self._viewers:
                self._rest()

    def end(self) -> None:
        """The rig was changed, or the server ends."""
        self._rest()
        for viewer in self._viewers:
            viewer.end(Unavailable(say("rig.changed", "This rig was changed or removed."), OPEN_AGAIN,
                                   reason="rig-gone"))

    def _rest(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._tasks = []

    async def _follow(self, name: str) -> None:
        """One camera, again and again: it may be switched off, changed, or come later."""
        while True:
            try:
                with self._camera(name).detections.listening(INPUT_FPS) as viewer:
                    while True:
                        self._add(name, decode_body(await viewer.next(SILENT_S))[0])
            except TouchlineError as error:
                self._problems[name] = error
            except (TimeoutError, ConnectionResetError, KeyError, TypeError):  # nothing, or nothing that can be read
                self._problems[name] = Unavailable(SENDS_NO_FRAMES, say("advice.check-state", "Check its state."),
                                                   reason="camera-silent")
            await asyncio.sleep(RETRY_S)

    def _add(self, name: str, message: dict[str, Any]) -> None:
        self._received_s[name] = time.monotonic()
        self._problems.pop(name, None)
        if message["calibration"] is None:
            self._problems[name] = Unavailable(NOT_CALIBRATED, say("advice.activate", "Activate a calibration."),
                                               reason="not-calibrated")
        self._tracker.add(name, message["time_s"], [Detection.from_json(item) for item in message["items"]])

    async def _send(self) -> None:
        while True:
            await asyncio.sleep(INTERVAL_S)
            if self._received_s or len(self._problems) == len(self.names):
                text = json.dumps(self._to_json(), separators=(",", ":")).encode()
                now = asyncio.get_running_loop().time()
                for viewer in self._viewers:
                    viewer.offer(text, now)

    def _to_json(self) -> dict[str, Any]:
        tracks = self._tracker.to_json()
        now, received, problems = time.monotonic(), self._received_s, self._problems
        return {"time_s": round(self._tracker.now_s or time.time(), 4), "items": tracks, "seams": seams_of(tracks),
                "cameras": [{"camera": name, "age_s": round(now - received[name], 3) if name in received else None,
                             "problem": problems[name].to_json() if name in problems else None}
                            for name in self.names]}
