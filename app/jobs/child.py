"""The process that does jobs, one after another: told what to do on a line, and gone when the line is.

Every message is HEADER (its kind, how many bytes follow), then JSON. Nothing is pickled. Told: RUN {"number", "run":
"module:function", "spec"} and CANCEL {"number"}. Answered: READY once; for each job BEGUN, PROGRESS {"fraction",
"message"}, then RESULT with what the function returned, or PROBLEM.

It is started by path, with little memory, low priority and arithmetic on one thread; the server's own processes go
first.
"""

import contextlib
import json
import os
import queue
import socket
import struct
import sys
import threading
import time
from importlib import import_module

HEADER = struct.Struct("<BI")
READY, RUN, CANCEL, BEGUN, PROGRESS, RESULT, PROBLEM = range(7)
LEAST_S = 0.05  # between two reports of progress; more often nobody sees
NICE = 5


def main() -> None:
    """Serve standard input, a socket, until it closes. Arguments: paths for imports and modules, as JSON; bytes."""
    sys.path[:] = json.loads(sys.argv[1])
    from app.processes.framing import confine
    os.nice(NICE)
    confine(int(sys.argv[3]))
    import cv2
    cv2.setNumThreads(1)
    for module in json.loads(sys.argv[2]):  # what jobs will need: a cancelled one has no time to import it
        import_module(module)
    Child(socket.socket(fileno=0)).serve()


class Child:
    """One line, and the jobs that come over it."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        self._given: queue.SimpleQueue[dict] = queue.SimpleQueue()
        self._cancelled = -1  # number of the job that is to stop
        self._told_at, self._told = 0.0, ""

    def serve(self) -> None:
        threading.Thread(target=self._listen, daemon=True).start()
        self._send(READY, {})
        while True:
            self._do(self._given.get())

    def _do(self, task: dict) -> None:
        from app.core.errors import Cancelled
        from app.jobs.execute import execute

        def progress(fraction: float, message: str) -> None:
            if self._cancelled == task["number"]:
                raise Cancelled("The job was cancelled.", "Start it again.")
            now = time.monotonic()
            if message != self._told or now - self._told_at >= LEAST_S:
                self._told_at, self._told = now, message
                self._send(PROGRESS, {"fraction": float(fraction), "message": message})

        self._send(BEGUN, {})
        whole, value = execute(task["run"], task["spec"], progress)
        self._send(RESULT if whole else PROBLEM, value)

    def _listen(self) -> None:
        """Hear what is told while a job runs; without a server there is nobody to work for."""
        from app.processes.framing import read_exactly
        with contextlib.suppress(OSError):
            while True:
                kind, length = HEADER.unpack(read_exactly(self._line, HEADER.size))
                body = json.loads(read_exactly(self._line, length))
                if kind == RUN:
                    self._given.put(body)
                else:
                    self._cancelled = body["number"]
        os._exit(0)

    def _send(self, kind: int, value: object) -> None:
        from app.jobs.execute import plain
        text = json.dumps(plain(value), allow_nan=False).encode("ascii")
        self._line.sendall(HEADER.pack(kind, len(text)) + text)


if __name__ == "__main__":
    main()
