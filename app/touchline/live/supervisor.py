"""In the server: a camera's process kept alive; one from which no frame comes is killed and started anew, for ever."""

import asyncio
from collections.abc import Callable
from typing import Any

from touchline.core.errors import ProblemJson, TouchlineError, Unavailable
from touchline.core.sentences import CHECK_STATE_TRY_AGAIN, FREE_MEMORY, TRY_AGAIN
from touchline.core.statements import say
from touchline.live import messages
from touchline.live.state import KILL_AFTER_S, ProcessStatus, stall_reason
from touchline.processes.framing import Message, decode_body
from touchline.processes.start import AsyncProcess, Program

MEMORY_BYTES = 6 << 30  # of addresses; FFmpeg and camera libraries reserve much more than they use
RETRY_S, MAX_RETRY_S = 0.5, 5.0
POLL_S = 0.1
LATE_S = 0.5  # the event loop itself was held up: what the camera sent meanwhile lies unread


class CameraProcess(AsyncProcess):
    """What a camera sends is a stranger's, and may make this process die, never the server."""

    PROGRAM = Program("touchline.live.worker_main:main", MEMORY_BYTES)
    START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
    CANNOT_START = (say("camera.process-cannot-start", "The camera process cannot be started."),
                    say("camera.free-memory", "Free some memory."), "camera-process")
    NOT_READY = (say("camera.process-not-ready", "The camera process does not start."), FREE_MEMORY, "camera-process")
    SILENT = say("camera.silent", "The camera is not responding."), CHECK_STATE_TRY_AGAIN, "camera-silent"
    ENDED = say("camera.process-ended", "The camera process has ended."), TRY_AGAIN, "camera-silent"


class CameraSupervisor:
    """Only for the event loop's own thread.

    spec: the process' arguments. on_start: called when a process was started, to send it what it must know. on_message:
    called with each message.
    """

    def __init__(self, name: str, spec: dict[str, Any], on_start: Callable[[], None],
                 on_message: Callable[[Message], None]) -> None:
        self._name, self._spec, self._on_start, self._on_message = name, spec, on_start, on_message
        self.restarts = 0
        self.status: ProcessStatus | None = None  # None until the first process has started
        self.problem: ProblemJson | None = None  # why no process could be started last
        self._process: CameraProcess | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def started(self) -> bool:
        return self._task is not None

    def start(self) -> None:
        if self._task is None:
            self._task = asyncio.create_task(self._keep_alive(), name=self._name)

    async def stop(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
            if not self._task.cancelled():
                self._task.result()

    def send(self, kind: int, head: dict[str, Any]) -> None:
        """Send a message if there is a process; one that is started later learns it from on_start."""
        if self._process is not None:
            self._process.send(kind, head)

    async def request(self, head: dict[str, Any], timeout_s: float) -> tuple[dict[str, Any], bytes]:
        """Return the process' answer; what it refuses is raised."""
        if self._process is None:
            what, fix = ((self.problem["what"], self.problem["fix"]) if self.problem
                         else (say("camera.starting", "The camera is still starting."), TRY_AGAIN))
            raise Unavailable(what, fix, reason="camera-silent")
        return await self._process.request(messages.REQUEST, head, timeout_s)

    async def _keep_alive(self) -> None:
        wait_s = RETRY_S
        while True:
            try:
                process = await CameraProcess.start(self._spec)
            except TouchlineError as error:
                self.problem = error.to_json()
            else:
                if await self._follow(process):
                    wait_s = RETRY_S
                self.restarts += 1
            await asyncio.sleep(wait_s)
            wait_s = min(2 * wait_s, MAX_RETRY_S)

    async def _follow(self, process: CameraProcess) -> bool:
        """Receive until the process dies, sends no JSON or has to be killed; return whether a frame came from it."""
        self._process = process
        self.status = ProcessStatus.initial(asyncio.get_running_loop().time())
        watchdog = asyncio.create_task(self._kill_when_stalled(process))
        try:
            self._on_start()
            while True:
                message = await process.receive()
                if message.kind == messages.STATUS:
                    self.status = self.status.updated(decode_body(message.body)[0],
                                                      asyncio.get_running_loop().time())
                self._on_message(message)
        except (asyncio.IncompleteReadError, OSError):
            return self.status.values["seq"] > 0
        finally:
            watchdog.cancel()
            self._process = None
            await asyncio.shield(process.end())
            self.status = ProcessStatus(self.status.values | {"state": "connecting", "problem": None},
                                        self.status.received_s)

    async def _kill_when_stalled(self, process: CameraProcess) -> None:
        loop = asyncio.get_running_loop()
        looked, grace_s = loop.time(), 0.0
        while True:
            await asyncio.sleep(POLL_S)
            now = loop.time()
            if now - looked > POLL_S + LATE_S:  # we slept, not the camera
                grace_s = now - looked
            elif grace_s > 0:
                grace_s = max(0.0, grace_s - POLL_S)
            looked = now
            if self.status is not None and stall_reason(self.status, now, KILL_AFTER_S + grace_s):
                process.kill()
                return
