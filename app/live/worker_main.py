"""The process of one camera: reads, corrects, encodes, and tells how it goes, on one line; gone when the line is.

Started by path, with arithmetic on one thread and a limit on memory: what a camera sends is a stranger's, and may make
this process die, never the server. wire.py says what goes over the line.
"""

import contextlib
import json
import os
import socket
import sys
import threading
import time

MEMORY_BYTES = 6 << 30  # of addresses; FFmpeg and camera libraries reserve much more than they use
STATUS_S = 0.2


def main() -> None:
    """Serve standard input, a socket, until it closes. Argument: the paths for imports, as JSON."""
    sys.path[:] = json.loads(sys.argv[1])
    from app.processes.framing import confine
    confine(MEMORY_BYTES)
    import cv2
    cv2.setNumThreads(1)
    from app.live.worker_server import Serving
    Serving(Line(socket.socket(fileno=0))).run()


class Line:
    """The socket to the server: whole messages, one at a time, from any thread."""

    def __init__(self, line: socket.socket) -> None:
        from app.live import messages
        from app.processes.framing import read_exactly
        self._wire, self._read = messages, read_exactly
        self._line = line
        self._lock = threading.Lock()

    def send(self, kind: int, number: int, body: bytes) -> None:
        with self._lock:
            self._line.sendall(self._wire.HEADER.pack(kind, number, len(body)))
            self._line.sendall(body)

    def receive(self) -> tuple[int, int, bytes]:
        """The next message; ends the process when the server is gone: there is nobody to work for."""
        try:
            kind, number, length = self._wire.HEADER.unpack(self._read(self._line, self._wire.HEADER.size))
            return kind, number, self._read(self._line, length)
        except OSError:
            os._exit(0)


def every(seconds: float, deed) -> None:
    """Do it again and again on a thread of its own."""
    def run() -> None:
        with contextlib.suppress(OSError):
            while True:
                deed()
                time.sleep(seconds)
    threading.Thread(target=run, daemon=True).start()


if __name__ == "__main__":
    main()
