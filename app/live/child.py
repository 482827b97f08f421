"""The process of one camera: reads, corrects, encodes, and tells how it goes, on one line; gone when the line is.

Started by path, with arithmetic on one thread and a limit on memory: what a camera sends is a stranger's, and may make
this process die, never the server. wire.py says what goes over the line.
"""

import contextlib
import json
import os
import resource
import socket
import sys
import threading
import time

MEMORY_BYTES = 6 << 30  # of addresses; FFmpeg and camera libraries reserve much more than they use
STATUS_S = 0.2


def main() -> None:
    """Serve standard input, a socket, until it closes. Argument: the paths for imports, as JSON."""
    sys.path[:] = json.loads(sys.argv[1])
    _confine()
    import cv2
    cv2.setNumThreads(1)
    from app.live.child_serving import Serving
    Serving(Line(socket.socket(fileno=0))).run()


class Line:
    """The socket to the server: whole messages, one at a time, from any thread."""

    def __init__(self, line: socket.socket) -> None:
        from app.live import wire
        self._wire = wire
        self._line = line
        self._lock = threading.Lock()

    def send(self, kind: int, number: int, body: bytes) -> None:
        with self._lock:
            self._line.sendall(self._wire.HEADER.pack(kind, number, len(body)))
            self._line.sendall(body)

    def receive(self) -> tuple[int, int, bytes]:
        """The next message; ends the process when the server is gone: there is nobody to work for."""
        try:
            kind, number, length = self._wire.HEADER.unpack(self._read(self._wire.HEADER.size))
            return kind, number, self._read(length)
        except OSError:
            os._exit(0)

    def _read(self, length: int) -> bytes:
        data = bytearray()
        while len(data) < length:
            part = self._line.recv(min(length - len(data), 1 << 20))
            if not part:
                raise ConnectionResetError
            data += part
        return bytes(data)


def every(seconds: float, deed) -> None:
    """Do it again and again on a thread of its own."""
    def run() -> None:
        with contextlib.suppress(OSError):
            while True:
                deed()
                time.sleep(seconds)
    threading.Thread(target=run, daemon=True).start()


def _confine() -> None:
    for what, most in ((resource.RLIMIT_AS, MEMORY_BYTES), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(what)
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (limit, limit))


if __name__ == "__main__":
    main()
