"""One decoding process seen from outside: started, asked under a deadline, killed when it misbehaves."""

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.core.errors import Unavailable
from app.images import child
from app.images.limits import DeclaredImage, ImageLimits

START_S = 30.0  # importing OpenCV takes 0.2 s, on a busy small machine some seconds
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


class WorkerDied(Exception):
    """The process ended in the middle of an answer."""


class WorkerTimeout(Exception):
    """The process gave no answer in time."""


class Worker:
    """A decoding process. Not thread-safe: whoever holds it has it alone. After an exception it is dead."""

    def __init__(self, limits: ImageLimits) -> None:
        self._limits = limits
        self._line, theirs = socket.socketpair()
        # A session of its own: an operator's Ctrl-C is for the server, which then ends its children.
        # Our settings may hold a token; a process that reads strangers' bytes has no use for it.
        environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE")} | ONE_THREAD
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", str(Path(child.__file__)), str(limits.memory_bytes)], env=environment,
                stdin=theirs, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        self._ready = False

    @property
    def pid(self) -> int:
        return self._process.pid

    def decode(self, data: bytes, declared: DeclaredImage) -> tuple[int, int, int, NDArray[np.uint8] | None]:
        """(status, width, height, pixels) as child.py says; pixels only where the status is DECODED."""
        try:
            self._await_ready()
            deadline = time.monotonic() + self._limits.wall_s
            self._send(child.REQUEST.pack(len(data), declared.width, declared.height, self._limits.wall_s), deadline)
            self._send(data, deadline)
            status, width, height = child.ANSWER.unpack(self._receive(bytearray(child.ANSWER.size), deadline))
            if status != child.DECODED:
                return status, width, height, None
            pixels = np.empty((declared.height, declared.width, 3), np.uint8)
            self._receive(memoryview(pixels).cast("B"), deadline)
            return status, width, height, pixels
        except TimeoutError:
            self.dispose()
            raise WorkerTimeout from None
        except OSError:
            self.dispose()
            raise WorkerDied from None
        except BaseException:
            self.dispose()  # an answer read by half would be taken for the next one's
            raise

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def end(self) -> None:
        """End the process now and wait until it is gone; whoever waits for its answer gets WorkerDied."""
        self._process.kill()
        self._process.wait()

    def dispose(self) -> None:
        """End it and close our end of the line; only for who holds it."""
        self.end()
        self._line.close()

    def _await_ready(self) -> None:
        down = Unavailable("The process that decodes pictures does not start.",
                           "Free some memory, or reinstall Touchline.", reason="decoder-down")
        if not self.alive:
            raise down
        if self._ready:
            return
        try:
            self._receive(bytearray(child.ANSWER.size), time.monotonic() + START_S)
        except OSError:
            raise down from None
        self._ready = True

    def _send(self, data: bytes, deadline: float) -> None:
        self._line.settimeout(max(0.001, deadline - time.monotonic()))
        self._line.sendall(data)

    def _receive(self, into: bytearray | memoryview, deadline: float) -> bytearray | memoryview:
        view, done = memoryview(into), 0
        while done < len(view):
            self._line.settimeout(max(0.001, deadline - time.monotonic()))
            received = self._line.recv_into(view[done:])
            if received == 0:
                raise ConnectionResetError
            done += received
        return into
