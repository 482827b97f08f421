"""One camera, live: its newest pictures for whoever watches, its state, and what can be asked of it.

The server never touches a pixel and never waits for a camera: its process is watched from outside (supervisor.py).
"""

import asyncio
import contextlib
import logging
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from touchline.core.errors import BadInput, Conflict, ProblemJson, Unavailable
from touchline.core.records import Calibration
from touchline.core.sentences import ACTIVATE_OR_RAW, NOT_CALIBRATED, OPEN_AGAIN
from touchline.core.statements import say
from touchline.live import messages
from touchline.live.camera_feed import CameraFeed
from touchline.live.failures import failure_words
from touchline.live.messages import (
    VIEWS,
    CameraState,
    CameraStatus,
    FailuresJson,
    PictureQuality,
    ProcessValues,
    StreamSpec,
)
from touchline.live.streams import Streams, Viewer
from touchline.live.supervisor import (
    POLL_S,
    CameraSupervisor,
    calibration_mismatch,
    camera_problem,
    frozen_doubt,
    frozen_reason,
    stall_reason,
    unmonitored,
)
from touchline.processes.framing import Message, error_from_json
from touchline.sources import Identity
from touchline.vision.picture_print import PicturePrint

UNKNOWN_QUALITY: PictureQuality = {
    "still": None,
    "print": None,
    "light": None,
    "sharpness": None,
    "flicker": None,
    "words": [],
}
SEEN = ("live", "mismatch")  # states of a camera that gives pictures, whatever they are worth
log = logging.getLogger("touchline")
Trust = Callable[[Calibration, Identity], None]
# of the camera's id, and of what sends its settings
MakeFeed = Callable[[str, Callable[[], None]], CameraFeed]


class LiveCamera:
    """Only for the event loop's own thread. start() it, and stop() it in the end.

    spec: what its process must know: source, fields, pictures, hosts, limits. trust: called with the camera that is
    seen first with a calibration of which nobody knows for which camera it was made. feeds: what capabilities have of
    it in the server, by the number of their part in spec["parts"].
    """

    def __init__(
        self,
        id: str,
        spec: dict[str, Any],
        trust: Trust = lambda _calibration, _identity: None,
        feeds: Mapping[int, MakeFeed] = MappingProxyType({}),
    ) -> None:
        self.id = id
        self.spec = spec
        self._trust = trust
        self._supervisor = CameraSupervisor(f"camera {id}", spec, self._on_start, self._on_message)
        self._streams = Streams(self._send_streams)
        self._feed_of_part: dict[int, CameraFeed] = {}
        for number, make in feeds.items():
            with self._surviving(f"feed of part {number}"):
                self._feed_of_part[number] = make(id, partial(self._send_settings, number))
        self.feeds: Mapping[str, CameraFeed] = {
            feed.NAME: feed for feed in self._feed_of_part.values()
        }
        self.calibration: Calibration | None = None
        self._picture: dict[str, Any] | None = None
        self._confirmed: Identity | None = None
        self._applied = False
        self._failures_logged = 0

    def start(self) -> None:
        self._supervisor.start()

    async def stop(self) -> None:
        """End the process and whoever watches."""
        await self._supervisor.stop()
        gone = Unavailable(
            say("camera.changed", "This camera was changed or removed."),
            OPEN_AGAIN,
            reason="camera-gone",
        )
        self._streams.end(gone)
        for feed in self.feeds.values():
            with self._surviving(feed.NAME):
                feed.end(gone)

    # What is known

    @property
    def identity(self) -> Identity | None:
        """The evidence of which camera this is; None until its source was opened once."""
        process = self._supervisor.status
        return process.identity if process else None

    @property
    def picture_print(self) -> PicturePrint | None:
        """What its newest picture tells of which camera it is; None where there is none, or nothing in it."""
        process = self._supervisor.status
        quality = process.values["quality"] if process is not None else None
        seen = (
            quality and quality["print"]
            if self._state(asyncio.get_running_loop().time())[0] in SEEN
            else None
        )
        return PicturePrint.from_text(seen) if seen else None

    @property
    def _scheme(self) -> str:
        return self.spec["source"].partition(":")[0]

    def status(self) -> CameraStatus:
        process, now = self._supervisor.status, asyncio.get_running_loop().time()
        state, problem = self._state(now)
        values: ProcessValues = process.values if process else {}
        quality = values.get("quality") or UNKNOWN_QUALITY
        size = process.size if process else None
        drift = values.get("drift") if state == "live" and self._applied else None
        if (
            drift is not None
            and process is not None
            and (doubt := frozen_doubt(process, self._scheme)) is not None
        ):
            drift = unmonitored(drift, doubt)
        interval_s = values.get("interval_s", 0)
        return {
            "state": state,
            "problem": problem,
            "fps": round(1 / interval_s, 2) if interval_s else 0.0,
            "width": size.width if size else None,
            "height": size.height if size else None,
            "frame_age_s": process.frame_age_s(now) if process else None,
            "reconnects": self._supervisor.restarts + max(0, values.get("reopened", 0) - 1),
            "viewers": self._streams.viewer_count,
            "calibration_applied": self._applied,
            "active_calibration": self.calibration.id if self.calibration else None,
            "light": quality["light"],
            "sharpness": quality["sharpness"],
            "flicker": quality["flicker"],
            "words": [*failure_words(values.get("failures")), *quality["words"]],
            "drift": drift,
            "drift_px": drift["px"] if drift else None,
            "seq": values.get("seq"),
            "identity": values.get("identity"),
            "reopened": values.get("reopened"),
            "encoded": values.get("encoded"),
        }

    def require_view(self, view: str) -> None:
        """Raise Conflict, with what to do, where that view cannot be had now; BadInput for one that is not known."""
        if view == "raw":
            return
        if view not in VIEWS:
            for feed in self.feeds.values():
                if view in feed.views:
                    feed.require_view(view)
                    return
            known = (*VIEWS, *(view for feed in self.feeds.values() for view in feed.views))
            raise BadInput(
                f"There is no view called {view[:40]!r}.",
                f"Use one of: {', '.join(known)}.",
                reason="unknown-view",
            )
        if self.calibration is None:
            raise Conflict(NOT_CALIBRATED, ACTIVATE_OR_RAW, reason="not-calibrated")
        if mismatch := self._mismatch():
            raise Conflict(mismatch["what"], mismatch["fix"], reason=mismatch["reason"])

    def _state(self, now: float) -> tuple[CameraState, ProblemJson | None]:
        process = self._supervisor.status
        if not self._supervisor.started:
            return "idle", None
        if process is None:
            return (
                ("offline", self._supervisor.problem)
                if self._supervisor.problem
                else ("connecting", None)
            )
        if why := stall_reason(process, now):
            return "stalled", camera_problem(
                "stalled",
                why,
                say(
                    "camera.reconnects",
                    "Check its cable, its power and the network. Touchline reconnects "
                    "automatically.",
                ),
            )
        if process.values["state"] != "live":
            return process.values["state"], process.values["problem"]
        if why := frozen_reason(process, self._scheme):
            return "stalled", camera_problem(
                "frozen",
                why,
                say("camera.restart", "Restart the camera, or the device that sends its images."),
            )
        if mismatch := self._mismatch():
            return "mismatch", mismatch
        return "live", None

    def _mismatch(self) -> ProblemJson | None:
        size, process = (
            self.calibration.image_size if self.calibration else None,
            self._supervisor.status,
        )
        return calibration_mismatch(process, self._confirmed, size) if process else None

    # What is asked for

    def show(
        self,
        calibration: Calibration | None,
        confirmed: Identity | None,
        picture: dict[str, Any] | None = None,
    ) -> None:
        """Correct with this from now on, as long as the camera is the confirmed one.

        picture: where the one is stored that the calibration came from, {"name", "path", "sha256"}; if it is known.
        """
        self.calibration, self._confirmed, self._picture = calibration, confirmed, picture
        self._send_calibration()

    def refresh(self) -> None:
        """Let its feeds note that what is saved of it may have changed."""
        for feed in self.feeds.values():
            with self._surviving(feed.NAME):
                feed.refresh()

    def watching(
        self, spec: StreamSpec, max_fps: float | None = None
    ) -> contextlib.AbstractContextManager[Viewer]:
        """Return a context whose value is a viewer of that stream."""
        return self._streams.watching(spec, max_fps)

    async def still(
        self, frames: int = 1, timeout_s: float = 10.0, over_s: float = 0.0
    ) -> tuple[dict[str, Any], bytes]:
        """Return what the picture is, and its PNG; of one frame, or the background of many, spread over so long."""
        timeout_s += over_s
        return await self.request(
            "still", timeout_s + 5.0, frames=frames, over_s=over_s, timeout_s=timeout_s
        )

    async def first_still(self, timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """Return the same of one frame, from a camera that was just started; what its source refuses is raised."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + timeout_s
        while loop.time() < deadline:
            state, problem = self._state(loop.time())
            if state == "live":
                return await self.still(1, deadline - loop.time())
            if problem is not None:
                raise error_from_json(problem)
            await asyncio.sleep(POLL_S)
        raise Unavailable(
            say("source.no-image", "No image received from this source."),
            say("advice.check-address-cable-power", "Check its address, its cable and its power."),
            reason="camera-silent",
        )

    async def controls(self) -> list[dict[str, Any]]:
        return (await self.request("controls", 5.0))[0]["controls"]

    async def set_control(self, name: str, value: Any) -> dict[str, Any]:
        return (await self.request("set", 5.0, name=name, value=value))[0]["control"]

    async def request(
        self, what: str, answer_s: float, /, **values: Any
    ) -> tuple[dict[str, Any], bytes]:
        """Return what a part of its process answers to that request in time: JSON and payload."""
        return await self._supervisor.request({"what": what, **values}, answer_s)

    # What goes to the process and comes from it

    def _on_start(self) -> None:
        self._streams.clear()
        self._send_calibration()
        for number in self._feed_of_part:
            self._send_settings(number)
        self._send_streams()

    def _on_message(self, message: Message) -> None:
        if message.kind == messages.PICTURE:
            self._streams.publish(message.number, message.body, asyncio.get_running_loop().time())
        elif message.kind == messages.FEED:
            if message.number not in self._feed_of_part:
                raise ConnectionResetError
            feed = self._feed_of_part[message.number]
            with self._surviving(feed.NAME):
                feed.receive(message.body)
        elif message.kind == messages.STATUS and (process := self._supervisor.status) is not None:
            for feed in self.feeds.values():
                with self._surviving(feed.NAME):
                    feed.update_status(process.values)
            self._log_failures(process.values["failures"])
            if (
                self.calibration is not None
                and self._confirmed is None
                and self.identity is not None
            ):
                self._confirmed = self.identity
                self._trust(self.calibration, self.identity)
            if self._applied != self._may_apply():
                self._send_calibration()

    @contextlib.contextmanager
    def _surviving(self, feed: str) -> Iterator[None]:
        """Return a context in which a feed may fail and the picture goes on. A broken message ends the process."""
        try:
            yield
        except ConnectionResetError:
            raise
        except Exception:  # of a package installed beside
            log.exception("camera %s: the feed %r failed", self.id, feed)

    def _log_failures(self, failures: FailuresJson) -> None:
        """Log the first failure of a process, and whenever there are twice as many."""
        count, newest = failures["count"], failures["newest"]
        if count < self._failures_logged:
            self._failures_logged = 0  # of the process before
        if newest is not None and count >= max(2 * self._failures_logged, 1):
            self._failures_logged = count
            log.warning(
                "camera %s: %s: %s (failure %d)", self.id, newest["what"], newest["error"], count
            )

    def _may_apply(self) -> bool:
        """Whether the calibration is applied: only to a camera that has been seen; before, nobody knows which it is."""
        process = self._supervisor.status
        is_seen = process is not None and process.identity is not None and process.size is not None
        return self.calibration is not None and is_seen and self._mismatch() is None

    def _send_calibration(self) -> None:
        self._applied = self._may_apply()
        calibration = (
            self.calibration.to_json() if self.calibration is not None and self._applied else None
        )
        self._supervisor.send(
            messages.CALIBRATE, {"calibration": calibration, "picture": self._picture}
        )

    def _send_settings(self, part: int) -> None:
        if (feed := self._feed_of_part.get(part)) is not None:  # None while it is being made
            with self._surviving(feed.NAME):
                self._supervisor.send(messages.FOLLOW, {"part": part, "settings": feed.settings()})

    def _send_streams(self) -> None:
        self._supervisor.send(messages.STREAMS, {"streams": self._streams.to_json()})
