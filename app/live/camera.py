"""One camera, live: its process kept alive, its newest pictures handed to who watches, its state told.

The server never touches a pixel and never waits for a camera: the process is watched from outside, and one from which
no frame comes is killed and started anew, for ever.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from app.core.errors import Conflict, TouchlineError, Unavailable
from app.core.records import Calibration
from app.live import messages
from app.live.detection_feed import DetectionFeed, Publish
from app.live.process import KINDS, CameraProcess
from app.live.state import KILL_AFTER_S, ProcessStatus, calibration_mismatch, frozen_reason, stall_reason
from app.live.stream_spec import VIEWS, StreamSpec
from app.live.viewer import Viewer
from app.sources import Identity

RETRY_S, MAX_RETRY_S = 0.5, 5.0
LOOK_S = 0.1
LATE_S = 0.5  # the event loop itself was held up: what the camera sent meanwhile lies unread
MAX_STREAMS = 16  # different pictures encoded at once
PASSED_ON = ("seq", "identity", "reopened", "encoded")


Trust = Callable[[Calibration, Identity], None]


class LiveCamera:
    """Only for the event loop's own thread. start() it, and stop() it in the end.

    spec: what its process must know: source, fields, pictures, hosts, limits. trust: called with the camera that is
    seen first with a calibration of which nobody knows for which camera it was made.
    """

    def __init__(self, id: str, spec: dict[str, Any], trust: Trust = lambda _calibration, _identity: None,
                 publish: Publish = lambda _packet: None) -> None:
        self.id = id
        self.spec = spec
        self._trust = trust
        self.detections = DetectionFeed(self._tell_seeing, publish)
        self.restarts = 0
        self._process: CameraProcess | None = None
        self._told: ProcessStatus | None = None
        self._problem: dict[str, Any] | None = None
        self._watchers: dict[StreamSpec, set[Viewer]] = {}
        self._numbers: dict[StreamSpec, int] = {}
        self._next_number = 0
        self._newest: dict[int, bytes] = {}
        self._calibration: Calibration | None = None
        self._picture: dict[str, Any] | None = None
        self._confirmed: Identity | None = None
        self._applied = False
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        if self._task is None:
            self._task = asyncio.create_task(self._keep_alive(), name=f"camera {self.id}")

    async def stop(self) -> None:
        """End the process and whoever watches."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
        for viewer in [v for watchers in self._watchers.values() for v in watchers]:
            viewer.end(Unavailable("This camera was changed or removed.", "Open it again.", reason="camera-gone"))
        self.detections.end()

    # What is known

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    @property
    def identity(self) -> Identity | None:
        """The evidence of which camera this is; None until its source was opened once."""
        return self._told.identity if self._told else None

    @property
    def calibration(self) -> Calibration | None:
        return self._calibration

    def status(self) -> dict[str, Any]:
        """Its state, with what is wrong and what to do about it; plain JSON."""
        told, now = self._told, asyncio.get_running_loop().time()
        state, problem = self._state(now)
        inspected = (told.status.get("inspected") if told else None) or {}
        size = told.size if told else None
        drift = told.status.get("drift") if told and state == "live" and self._applied else None
        interval = told.status["interval_s"] if told else 0
        return {"state": state, "problem": problem, "fps": round(1 / interval, 2) if interval else 0.0,
                "width": size.width if size else None, "height": size.height if size else None,
                "frame_age_s": told.frame_age_s(now) if told else None,
                "reconnects": self.restarts + max(0, (told.status["reopened"] if told else 0) - 1),
                "viewers": sum(len(watchers) for watchers in self._watchers.values()),
                "calibration_applied": self._applied,
                "active_calibration": self._calibration.id if self._calibration else None,
                "light": inspected.get("light"), "sharpness": inspected.get("sharpness"),
                "flicker": inspected.get("flicker"),
                "words": inspected.get("words", []), "drift": drift,
                "drift_px": drift["px"] if drift else None,
                **{name: told.status[name] if told else None for name in PASSED_ON}}

    def _state(self, now: float) -> tuple[str, dict[str, Any] | None]:
        told = self._told
        if told is None:
            return ("offline", self._problem) if self._problem else ("connecting", None)
        if why := stall_reason(told, now):
            return "stalled", {"reason": "stalled", "what": why, "fix": "Look at its cable, its power and the network; "
                               "it is tried again by itself."}
        if told.status["state"] != "live":
            return told.status["state"], told.status["problem"]
        if why := frozen_reason(told, self.spec["source"].partition(":")[0]):
            return "stalled", {"reason": "frozen", "what": why, "fix": "Restart the camera, or what sends its picture."}
        if wrong := self._mismatch():
            return "mismatch", dict(zip(("reason", "what", "fix"), wrong, strict=True))
        return "live", None

    def _mismatch(self) -> tuple[str, str, str] | None:
        size = self._calibration.image_size if self._calibration else None
        return calibration_mismatch(self._told, self._confirmed, size) if self._told else None

    def require_view(self, view: str) -> None:
        """Conflict, with what to do, where that view cannot be had now."""
        if view == "raw":
            return
        if view not in VIEWS:
            self.detections.require_view(view)
            return
        if self._calibration is None:
            raise Conflict("This camera has no active calibration.", "Activate one, or watch the raw view.",
                           reason="not-calibrated")
        if wrong := self._mismatch():
            raise Conflict(wrong[1], wrong[2], reason=wrong[0])

    # What is asked for

    def show(self, calibration: Calibration | None, confirmed: Identity | None,
             picture: dict[str, Any] | None = None) -> None:
        """Correct with this from now on, as long as the camera is the confirmed one.

        picture: where the one stands that the calibration came from, {"name", "path", "sha256"}; if it is known.
        """
        self._calibration, self._confirmed, self._picture = calibration, confirmed, picture
        self._tell_calibration()

    @contextlib.contextmanager
    def watching(self, channel: StreamSpec, most_fps: float | None = None) -> Iterator[Viewer]:
        """A viewer of a channel as long as the context lasts; it is encoded only while somebody watches."""
        if channel not in self._watchers:
            if len(self._watchers) >= MAX_STREAMS:
                raise Unavailable("This camera is watched in too many sizes and qualities.",
                                  "Ask for a width that others watch, such as 960.", reason="too-many-channels")
            self._next_number += 1
            self._watchers[channel], self._numbers[channel] = set(), self._next_number
        viewer = Viewer(most_fps)
        self._watchers[channel].add(viewer)
        newest = self._newest.get(self._numbers[channel])
        if newest is not None:
            viewer.offer(newest, asyncio.get_running_loop().time())
        self._tell_channels()
        try:
            yield viewer
        finally:
            self._watchers[channel].discard(viewer)
            if not self._watchers[channel]:
                del self._watchers[channel]
                self._newest.pop(self._numbers.pop(channel), None)
            self._tell_channels()

    async def still(self, frames: int = 1, timeout_s: float = 10.0,
                    over_s: float = 0.0) -> tuple[dict[str, Any], bytes]:
        """What the picture is, and its PNG; of one frame, or the background of many that are spread over so long."""
        timeout_s += over_s
        return await self._ask({"what": "still", "frames": frames, "over_s": over_s, "timeout_s": timeout_s},
                               timeout_s + 5.0)

    async def first_still(self, timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """The same of one frame, from a camera that was started just now; what its source refuses is raised."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout_s
        while loop.time() < deadline:
            state, problem = self._state(loop.time())
            if state == "live":
                return await self.still(1, deadline - loop.time())
            if problem is not None:
                raise KINDS.get(problem.get("kind", ""), Unavailable)(problem["what"], problem["fix"],
                                                                      reason=problem["reason"])
            await asyncio.sleep(LOOK_S)
        raise Unavailable("No picture has come from this source.", "Check its address, its cable and its power.",
                          reason="camera-silent")

    async def board(self, board: dict[str, Any], after: int) -> dict[str, Any]:
        """Where the board is in a frame after that one: board_capture.look()."""
        head, _ = await self._ask({"what": "board", "board": board, "after": after}, 10.0)
        return head

    async def rolls(self, watch: str, after: int, seq: int) -> dict[str, Any]:
        """What moves in a frame after that one, and the rolls that have ended since: live/rolls.py."""
        head, _ = await self._ask({"what": "rolls", "watch": watch, "after": after, "seq": seq}, 10.0)
        return head

    async def clip(self, seconds: float) -> tuple[dict[str, Any], bytes]:
        """What a clip's frames are, and their JPEGs one after the other: live/ring.py."""
        return await self._ask({"what": "clip", "seconds": seconds}, seconds + 20.0)

    async def controls(self) -> list[dict[str, Any]]:
        head, _ = await self._ask({"what": "controls"}, 5.0)
        return head["controls"]

    async def set_control(self, name: str, value: Any) -> dict[str, Any]:
        head, _ = await self._ask({"what": "set", "name": name, "value": value}, 5.0)
        return head["control"]

    async def _ask(self, head: dict[str, Any], timeout_s: float) -> tuple[dict[str, Any], bytes]:
        if self._process is None:
            problem = self._problem or {"what": "The camera is still starting.", "fix": "Try again in a moment."}
            raise Unavailable(problem["what"], problem["fix"], reason="camera-silent")
        return await self._process.ask(head, timeout_s)

    # How it is kept alive

    async def _keep_alive(self) -> None:
        wait_s = RETRY_S
        while True:
            try:
                process = await CameraProcess.start(self.spec)
            except TouchlineError as error:
                self._problem = {"reason": error.reason, "what": error.what, "fix": error.fix}
            else:
                if await self._live_with(process):
                    wait_s = RETRY_S
                self.restarts += 1
            await asyncio.sleep(wait_s)
            wait_s = min(2 * wait_s, MAX_RETRY_S)

    async def _live_with(self, process: CameraProcess) -> bool:
        """Until it dies or has to be killed; whether a frame came from it."""
        self._process, self._applied = process, False
        self._newest.clear()
        begun = asyncio.get_running_loop().time()
        self._told = ProcessStatus({"state": "connecting", "problem": None, "since_s": 0.0, "seq": 0, "interval_s": 0.0,
                           "identity": None, "reopened": 0, "age_s": None, "size": None, "encoded": 0}, begun)
        watchdog = asyncio.create_task(self._kill_when_stalled(process))
        try:
            self._tell_calibration()
            self._tell_seeing()
            self._tell_channels()
            while True:
                self._heard(process, *await process.receive())
        except (asyncio.IncompleteReadError, OSError):
            return self._told.status["seq"] > 0
        finally:
            watchdog.cancel()
            self._process = None
            await asyncio.shield(process.end())
            self._told = ProcessStatus(self._told.status | {"state": "connecting", "problem": None}, self._told.at)

    def _heard(self, process: CameraProcess, kind: int, number: int, body: bytes) -> None:
        now = asyncio.get_running_loop().time()
        if kind == messages.PICTURE:
            self._newest[number] = body
            for channel, known in self._numbers.items():
                if known == number:
                    for viewer in self._watchers[channel]:
                        viewer.offer(body, now)
        elif kind == messages.STATUS:
            self._told = ProcessStatus(messages.parts(body)[0], now)
            self.detections.told(self._told.status)
            if self._calibration is not None and self._confirmed is None and self.identity is not None:
                self._confirmed = self.identity
                self._trust(self._calibration, self.identity)
            if self._applied != self._may_apply():
                self._tell_calibration()
        elif kind == messages.DETECTIONS:
            self.detections.heard(body)
        elif kind == messages.ANSWER:
            process.answered(number, body)

    async def _kill_when_stalled(self, process: CameraProcess) -> None:
        loop = asyncio.get_running_loop()
        looked, grace_s = loop.time(), 0.0
        while True:
            await asyncio.sleep(LOOK_S)
            now = loop.time()
            if now - looked > LOOK_S + LATE_S:  # we slept, not the camera
                grace_s = now - looked
            elif grace_s > 0:
                grace_s = max(0.0, grace_s - LOOK_S)
            looked = now
            if stall_reason(self._told, now, KILL_AFTER_S + grace_s):
                process.kill()
                return

    # What the process is told

    def _may_apply(self) -> bool:
        """Only to a camera that has been seen: before that, nobody knows which it is."""
        seen = self._told is not None and self._told.identity is not None and self._told.size is not None
        return self._calibration is not None and seen and self._mismatch() is None

    def _tell_calibration(self) -> None:
        self._applied = self._may_apply()
        if self._process is not None:
            calibration = self._calibration.to_json() if self._applied else None
            self._process.send(messages.CALIBRATE, {"calibration": calibration, "picture": self._picture})

    def _tell_seeing(self) -> None:
        if self._process is not None:
            self._process.send(messages.DETECT, self.detections.message())

    def _tell_channels(self) -> None:
        if self._process is None:
            return
        self._process.send(messages.STREAMS, {"channels": [
            {"number": self._numbers[channel], "channel": channel.to_json(),
             "interval_s": min(viewer.interval_s for viewer in watchers)}
            for channel, watchers in self._watchers.items()]})
