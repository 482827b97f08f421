"""The parts of a running server in one object, which every route and socket receives as `services`."""

import asyncio
import logging
import os
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sequence
from contextlib import AsyncExitStack, aclosing, asynccontextmanager, suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar

import anyio
from anyio import CapacityLimiter, to_thread

from touchline.capabilities import CAPABILITIES, camera_feeds, loaded_by_name
from touchline.core.errors import Cancelled, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.jobs import NOBODY, Caller, Progress
from touchline.core.records import Frame
from touchline.evaluate.claims import Claim
from touchline.images import ImageDecoder, ImageLimits
from touchline.jobs import Job, JobEngine
from touchline.models import CameraModel
from touchline.services.activity import CameraEvents, Presence
from touchline.services.answer_cache import AnswerCache
from touchline.services.cameras import CameraService
from touchline.services.fit_processes import FitProcesses, closed_request
from touchline.services.live import LiveCameras, start_live_cameras, take_frame
from touchline.services.running_part import RunningPart
from touchline.settings import CameraSettings, Settings
from touchline.store.fields import FieldRepository
from touchline.store.files import remove_temporary_files
from touchline.store.opening import Restoration
from touchline.store.repository import LruCache
from touchline.store.snapshots import Snapshot
from touchline.store.store import Store
from touchline.vision.picture_print import PicturePrint

log = logging.getLogger("touchline")
Given = ParamSpec("Given")
Result = TypeVar("Result")
Part = TypeVar("Part")
IsAbandoned = Callable[[], Awaitable[bool]]  # whether the caller has gone
# decoded snapshots: a picture that is looked at is asked for many times in a row
MAX_FRAME_BYTES = 256 << 20
MAX_MODELS = 100  # by their version's checksum; to restore one may take a millisecond
MAX_CLAIMS_KEPT = 500  # of versions, by what never changes: their own pictures, and one another
MAX_PRINTS_KEPT = 500  # of calibration images, 3 kB each
MAX_LARGE = 2  # pictures at once
LARGE_PX = 4e6  # of a picture that is drawn or looked through: a second, and 100 MB
EVENTS_POLL_S = 0.05  # how often a job that somebody waits for is looked at
# between the frames of a background: who walks by needs some seconds to leave
FRAME_INTERVAL_S = 1 / 3
POLLS_PER_CHECK = 10  # and after how many looks whether its caller still waits


class Services:
    """Made from the settings alone; decoder, live cameras and parts exist while it is running().

    running_parts: what capabilities keep running, in the order of their table.
    """

    decoder: ImageDecoder
    live: LiveCameras
    running_parts: Sequence[RunningPart]
    _threads: CapacityLimiter
    _large: CapacityLimiter
    _quick: CapacityLimiter

    def __init__(
        self,
        settings: Settings,
        store: Store,
        jobs: JobEngine,
        fits: FitProcesses,
        comparisons: FitProcesses,
        limits: ImageLimits,
        serves: bool = True,
    ) -> None:
        self.settings, self.store, self.jobs, self.fits, self.comparisons = (
            settings,
            store,
            jobs,
            fits,
            comparisons,
        )
        self.started_s = time.monotonic()
        remove_temporary_files(settings.own_fields)
        self.fields = FieldRepository(settings.own_fields, store.failures)
        self.cameras = CameraService(settings, store, self.fields, limits)
        self.presence = Presence()
        self.events = CameraEvents()
        self.answers = AnswerCache()
        self.models: LruCache[str, CameraModel] = LruCache(MAX_MODELS)
        self.claims_kept: LruCache[tuple[str, ...], Sequence[Claim]] = LruCache(MAX_CLAIMS_KEPT)
        self._prints: LruCache[str, tuple[PicturePrint | None]] = LruCache(MAX_PRINTS_KEPT)
        self._frames: LruCache[str, Frame] = LruCache(
            MAX_FRAME_BYTES, lambda frame: frame.pixels.nbytes
        )
        self._limits, self._serves = limits, serves
        self._parts: dict[type, Any] = {}
        self._parts_lock = threading.RLock()  # a part may ask for another while it is made

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Hold the store and start what has processes; jobs that a stop has cut short go on."""
        with self.store, ImageDecoder(self._limits) as self.decoder, self.jobs:
            self._threads = CapacityLimiter(max(4, os.cpu_count() or 4))
            self._large = CapacityLimiter(MAX_LARGE)
            self._quick = CapacityLimiter(1)
            self.jobs.open(self.store.jobs, resume=self._serves)
            feeds = {part: partial(feed, self) for part, feed in camera_feeds().items()}
            live = start_live_cameras(self.cameras, feeds, wake=self._serves)
            async with (
                self.fits.running(),
                self.comparisons.running(),
                aclosing(live) as self.live,
                self._closing_parts(),
            ):
                self.running_parts = [*self._started_parts()]
                async with self.events.following(live):
                    yield

    def part(self, kind: type[Part]) -> Part:
        """Return what a capability keeps while the server runs: kind(services), made when it is first asked for.

        One that has aclose() is closed when the server stops.
        """
        with self._parts_lock:
            if kind not in self._parts:
                self._parts[kind] = kind(self)  # type: ignore[call-arg]
            made: Part = self._parts[kind]
            return made

    def _started_parts(self) -> Iterator[RunningPart]:
        for name, kind in loaded_by_name("running"):
            try:
                part: RunningPart = self.part(kind)
                if self._serves:
                    part.start()
            except Exception as error:  # another's code
                if name in CAPABILITIES:
                    raise
                log.error("The part of %r cannot run: %s: %s", name, type(error).__name__, error)
                continue
            yield part

    @asynccontextmanager
    async def _closing_parts(self) -> AsyncIterator[None]:
        """Close all parts at the end, the last one that was made first, each also where another one fails."""
        try:
            yield
        finally:
            with self._parts_lock:
                parts, self._parts = self._parts, {}
            async with AsyncExitStack() as stack:
                for part in parts.values():
                    if hasattr(part, "aclose"):
                        stack.push_async_callback(part.aclose)

    def frame(self, snapshot: str) -> Frame:
        """Return a snapshot decoded; NotFound."""
        return self._frames.get_or_make(
            snapshot, lambda: self.decoder.frame_from_bytes(self.store.snapshots.picture(snapshot))
        )

    def picture_print(self, snapshot: str | None) -> PicturePrint | None:
        """Return what a snapshot tells of which camera it is; None where there is none, or nothing in it."""

        def made(of: str) -> tuple[PicturePrint | None]:
            try:
                return (
                    PicturePrint.of(
                        self.decoder.frame_from_bytes(self.store.snapshots.picture(of)).pixels
                    ),
                )
            except TouchlineError:  # it was deleted, or is damaged
                return (None,)

        return (
            None
            if snapshot is None
            else self._prints.get_or_make(snapshot, partial(made, snapshot))[0]
        )

    async def take_snapshot(
        self,
        camera: str,
        is_abandoned: IsAbandoned,
        frames: int = 1,
        over_s: float | None = None,
        purpose: str = "picture",
    ) -> Snapshot:
        """Take and save one frame, or what most of several agree on; nothing where the caller has gone meanwhile."""
        over_s = FRAME_INTERVAL_S * (frames - 1) if over_s is None else over_s
        frame = await take_frame(self.live.get(camera), frames=frames, over_s=over_s)
        if await is_abandoned():
            raise Cancelled("The request for this image was closed.", "Take the image again.")
        return await self.run_in_thread(frame.save, self.store, purpose)

    async def restore_backup(self, seen: tuple[int, int]) -> Restoration:
        """Put the newest good backup in the database's place, and let everything go on with what is in it."""

        def restore() -> Restoration:
            with self.jobs.idle():
                done = self.store.restore_backup(seen)
                self.jobs.open(self.store.jobs, resume=self._serves)
            return done

        # none can be read where the database is damaged as a whole
        before: dict[str, CameraSettings] = {}
        with suppress(TouchlineError):
            before = {camera.id: camera for camera in await self.run_in_thread(self.cameras.all)}
        done = await self.run_in_thread(restore)
        after = {camera.id: camera for camera in await self.run_in_thread(self.cameras.all)}
        for id in self.live.running:
            if before.get(id) != after.get(id):
                await self.live.forget(id)
        for id in after:
            self.live.refresh(id)
        return done

    async def run_in_thread(
        self, work: Callable[Given, Result], *args: Given.args, **kwargs: Given.kwargs
    ) -> Result:
        """Run work of a second or two on a worker thread; when all are busy it waits for its turn."""
        return await to_thread.run_sync(lambda: work(*args, **kwargs), limiter=self._threads)

    async def fit_quickly(self, fit: Callable[[], Result], is_abandoned: IsAbandoned) -> Result:
        """Run a fit of some 20 ms on a thread: one at a time, since a second would only halve the pace of the first."""
        async with self._quick:
            if await is_abandoned():
                raise closed_request()
            return await to_thread.run_sync(fit)

    async def process_picture(
        self, size: ImageSize, work: Callable[[Progress], Result], is_abandoned: IsAbandoned
    ) -> Result:
        """Do work on a picture of about that size on a worker thread while its caller waits; on large ones few at once.

        work: calls its progress now and then, which raises Cancelled once the caller has gone.
        """
        gone = threading.Event()

        def progress(_share: float, _message: str) -> None:
            if gone.is_set():
                raise Cancelled("The request for this image was closed.", "Request it again.")

        async def watch() -> None:
            while not await is_abandoned():
                await anyio.sleep(POLLS_PER_CHECK * EVENTS_POLL_S)
            gone.set()

        watching = asyncio.create_task(watch())
        try:
            is_large = size.width * size.height > LARGE_PX
            return await to_thread.run_sync(
                work, progress, limiter=self._large if is_large else self._threads
            )
        finally:
            watching.cancel()

    async def run_as_job(
        self,
        kind: str,
        run: Callable[[Any, Progress], Any],
        spec: Any,
        is_abandoned: IsAbandoned,
        saver: str | None = None,
        context: Any = None,
        caller: Caller = NOBODY,
    ) -> Job:
        """Run work of many seconds in a process and wait for its end; cancel it once its caller has gone."""
        job = self.jobs.start(kind, run, spec, saver, context, durable=False, caller=caller)
        polls = 0
        try:
            while not self.jobs.get(job.id).ended:
                await anyio.sleep(EVENTS_POLL_S)
                polls += 1
                if polls % POLLS_PER_CHECK == 0 and await is_abandoned():
                    break
            return self.jobs.get(job.id)
        finally:
            self.jobs.cancel(job.id)
