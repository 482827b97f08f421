"""A few warm decoding processes behind one thread-safe call."""

import contextlib
import queue
import threading
from hashlib import sha256
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadImage, Unavailable
from touchline.core.records import Frame
from touchline.core.sentences import SHUTTING_DOWN, TRY_AGAIN, TRY_WHEN_BACK
from touchline.core.statements import say
from touchline.images import decoder_worker
from touchline.images.decoder_process import DecoderProcess
from touchline.images.limits import DEFAULT_LIMITS, RESAVE, SCALE_DOWN, DeclaredImage, ImageLimits
from touchline.images.screen import screen


class ImageDecoder:
    """Untrusted bytes to frames, any number of threads at once; `workers` pictures are decoded at a time.

    The processes start at once and warm up beside the caller (about 0.3 s); one that dies or is too slow is
    replaced at once. A caller waits at most patience_s for a free one. Use it as a context, or close() it.
    """

    def __init__(self, limits: ImageLimits = DEFAULT_LIMITS, *, workers: int = 2, patience_s: float = 30.0) -> None:
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
            raise BadImage(say("image.slow", "The image took longer than {seconds:g} s to decode.",
                               seconds=self.limits.wall_s), SCALE_DOWN, reason="slow-image") from None
        except OSError:
            worker = self._replace(worker)
            if self._closed:
                raise _shutting_down() from None
            raise BadImage(say("image.crashed-decoder", "The image crashed the decoder. The decoder has been "
                               "restarted."), RESAVE, reason="undecodable-image") from None
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
            raise BadImage(say("image.needs-memory", "The image needs more memory than a decoder is allowed."),
                           SCALE_DOWN, reason="image-needs-memory")
        raise declared.undecodable()

    def _take(self) -> DecoderProcess:
        """A living worker, nobody else's; one that was killed while it had nothing to do is replaced here."""
        if self._closed:
            raise _shutting_down()
        try:
            worker = self._free.get(timeout=self._patience_s)
        except queue.Empty:
            raise Unavailable(say("image.decoder-busy", "Too many images are being read at once."), TRY_AGAIN,
                              reason="decoder-busy") from None
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
