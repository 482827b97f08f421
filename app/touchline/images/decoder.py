"""A few warm decoding processes behind one thread-safe call: each asked under a deadline, killed when it misbehaves."""

import contextlib
import queue
import threading
import time
from functools import partial
from hashlib import sha256
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadImage, Unavailable
from touchline.core.records import Frame
from touchline.core.sentences import FREE_MEMORY, SHUTTING_DOWN, TRY_AGAIN, TRY_WHEN_BACK
from touchline.core.statements import say
from touchline.images import decoder_worker
from touchline.images.limits import DEFAULT_LIMITS, RESAVE, SCALE_DOWN, DeclaredImage, ImageLimits
from touchline.images.screen import screen
from touchline.processes.framing import Message
from touchline.processes.start import ChildProcess, Program

START_S = 30.0  # importing OpenCV takes 0.2 s, on a busy small machine some seconds
# it limits itself, once its codecs are loaded
PROGRAM = Program("touchline.images.decoder_worker:main")


class DecoderProcess:
    """A decoding process. Not thread-safe: whoever holds it has it alone. After an exception it is dead."""

    def __init__(self, limits: ImageLimits) -> None:
        self._limits = limits
        # Room for pixels need not be zeros first.
        self._child = ChildProcess(
            PROGRAM,
            {"memory_bytes": limits.memory_bytes},
            partial(np.empty, dtype=np.uint8),
            3 * limits.max_pixels,
        )
        self._is_ready = False
        self.pid = self._child.pid
        self.end = self._child.end  # by any thread: whoever waits for its answer gets OSError
        self.close = self._child.close

    @property
    def is_alive(self) -> bool:
        return self._child.is_alive

    def decode(self, data: bytes, declared: DeclaredImage) -> Message:
        """Return the answer for one picture (decoder_worker.py).

        TimeoutError where none comes within the limit of time, another OSError where the process ends before it.
        """
        try:
            self._await_ready()
            connection, wall_s = self._child.connection, self._limits.wall_s
            deadline = time.monotonic() + wall_s
            request = decoder_worker.REQUEST.pack(declared.width, declared.height, wall_s)
            connection.send(decoder_worker.DECODE, 0, request, data, timeout_s=wall_s)
            answer = connection.receive(deadline - time.monotonic())
            if answer is None:
                raise TimeoutError
            lengths = {
                decoder_worker.DECODED: 3 * declared.width * declared.height,
                decoder_worker.OTHER_SIZE: decoder_worker.SIZE.size,
            }
            if len(answer.body) != lengths.get(answer.kind, 0):
                raise ConnectionResetError
            return answer
        except BaseException:
            self.close()  # an answer read by half would be taken for the next one's
            raise

    def _await_ready(self) -> None:
        try:
            if not self.is_alive:
                raise ConnectionResetError
            if not self._is_ready:
                self._child.await_ready(START_S)
                self._is_ready = True
        except OSError:
            raise Unavailable(
                say("image.decoder-down", "The process that decodes images does not start."),
                FREE_MEMORY,
                reason="decoder-down",
            ) from None


class ImageDecoder:
    """Untrusted bytes to frames, any number of threads at once; `workers` pictures are decoded at a time.

    The processes start at once and warm up beside the caller (about 0.3 s); one that dies or is too slow is
    replaced at once. A caller waits at most patience_s for a free one. Use it as a context, or close() it.
    """

    def __init__(
        self, limits: ImageLimits = DEFAULT_LIMITS, *, workers: int = 2, patience_s: float = 30.0
    ) -> None:
        self.limits = limits
        self._patience_s = patience_s
        self._lock = threading.Lock()
        self._closed = False
        self._all = {DecoderProcess(limits) for _ in range(workers)}
        self._free: queue.LifoQueue[DecoderProcess] = queue.LifoQueue()  # the warmest first
        for worker in self._all:
            self._free.put(worker)

    def frame_from_bytes(self, data: bytes, *, camera: str | None = None) -> Frame:
        """Screen and decode; pixels (height, width, 3) BGR uint8, read-only, as the sensor saw them (no EXIF turn).

        BadImage or ImageTooLarge say why not; Unavailable when every process is busy for too long.
        """
        data = bytes(data)
        pixels = self._decode(data, screen(data, self.limits))
        pixels.setflags(write=False)
        return Frame(pixels, sha256(data).hexdigest(), camera)

    def close(self) -> None:
        """End all processes; a picture that is being decoded is refused."""
        with self._lock:
            self._closed = True
        for worker in self._all:
            worker.end()  # its holder, if there is one, notices and disposes of it
        with contextlib.suppress(queue.Empty):
            while True:
                self._free.get_nowait().close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _decode(self, data: bytes, declared: DeclaredImage) -> NDArray[np.uint8]:
        worker = self._take()
        try:
            answer = worker.decode(data, declared)
        except TimeoutError:
            worker = self._replace(worker)
            raise BadImage(
                say(
                    "image.slow",
                    "The image took longer than {seconds:g} s to decode.",
                    seconds=self.limits.wall_s,
                ),
                SCALE_DOWN,
                reason="slow-image",
            ) from None
        except OSError:
            worker = self._replace(worker)
            if self._closed:
                raise _shutting_down() from None
            raise BadImage(
                say(
                    "image.crashed-decoder",
                    "The image crashed the decoder. The decoder has been restarted.",
                ),
                RESAVE,
                reason="undecodable-image",
            ) from None
        except BaseException:
            worker = self._replace(worker)
            raise
        finally:
            self._free.put(worker)
        if answer.kind == decoder_worker.DECODED:
            return answer.body.reshape(declared.height, declared.width, 3)
        if answer.kind == decoder_worker.OTHER_SIZE:
            raise declared.other_size(*decoder_worker.SIZE.unpack(answer.body))
        if answer.kind == decoder_worker.OUT_OF_MEMORY:
            raise BadImage(
                say("image.needs-memory", "The image needs more memory than a decoder is allowed."),
                SCALE_DOWN,
                reason="image-needs-memory",
            )
        raise declared.undecodable()

    def _take(self) -> DecoderProcess:
        """A living worker, nobody else's; one that was killed while it had nothing to do is replaced here."""
        if self._closed:
            raise _shutting_down()
        try:
            worker = self._free.get(timeout=self._patience_s)
        except queue.Empty:
            raise Unavailable(
                say("image.decoder-busy", "Too many images are being read at once."),
                TRY_AGAIN,
                reason="decoder-busy",
            ) from None
        return worker if worker.is_alive else self._replace(worker)

    def _replace(self, dead: DecoderProcess) -> DecoderProcess:
        """A new process in place of a dead one; while closing there is none, and the dead one stays."""
        with self._lock:
            if self._closed:
                return dead
            try:
                worker = DecoderProcess(self.limits)
            except OSError:  # no process or memory to be had: the next caller tries again
                return dead
            self._all.discard(dead)
            self._all.add(worker)
        dead.close()
        return worker


def _shutting_down() -> Unavailable:
    return Unavailable(SHUTTING_DOWN, TRY_WHEN_BACK, reason="shutting-down")


def frame_from_bytes(data: bytes, limits: ImageLimits = DEFAULT_LIMITS) -> Frame:
    """One picture in a process of its own, for a shell that has no decoder running."""
    with ImageDecoder(limits, workers=1) as decoder:
        return decoder.frame_from_bytes(data)
