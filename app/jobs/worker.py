"""One working process seen from outside: started when first needed, killed when it does not stop, started anew."""

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import Any

from app.jobs import child
from app.jobs.runner import JobFailed, JobStopped, JobTimeout, Report, WorkerDied

START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
STOP_S = 1.0  # a cancelled job has so long to stop by itself
LOOK_S = 0.05  # how often we look whether a job is still wanted
MAX_ANSWER_BYTES = 64 << 20
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class Worker:
    """A place for one job at a time. Only end() may be called by another thread than its own."""

    def __init__(self, memory_bytes: int, modules: tuple[str, ...] = ()) -> None:
        self._modules = modules
        self._memory_bytes = memory_bytes
        self._process: subprocess.Popen[bytes] | None = None
        self._line: socket.socket | None = None
        self._unread = bytearray()
        self._number = 0
        self._begun = False
        self._lock = Lock()
        self._closed = False

    @property
    def pid(self) -> int | None:
        """The process, None where none runs."""
        process = self._process
        return process.pid if process and process.poll() is None else None

    def run(self, run: str, spec: Any, report: Report, wanted: Callable[[], bool], wall_s: float) -> Any:
        """Do a job and return its result; see place.py.

        A process that stood idle may have died unseen: a job that it never began is given to a new one.
        """
        stood_idle = self.pid is not None
        try:
            return self._run_once(run, spec, report, wanted, wall_s)
        except WorkerDied:
            if not stood_idle or self._begun or self._closed:
                raise
            return self._run_once(run, spec, report, wanted, wall_s)

    def _run_once(self, run: str, spec: Any, report: Report, wanted: Callable[[], bool], wall_s: float) -> Any:
        deadline = time.monotonic() + wall_s
        self._number += 1
        self._begun = False
        try:
            self._start()
            self._send(child.RUN, {"number": self._number, "run": run, "spec": spec})
            return self._follow(report, wanted, deadline)
        except OSError:
            self.drop()
            raise WorkerDied from None
        except (WorkerDied, JobTimeout, JobStopped):
            self.drop()
            raise

    def end(self) -> None:
        """End the process for good; whoever follows its job gets WorkerDied."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
                self._process.wait()

    def _follow(self, report: Report, wanted: Callable[[], bool], deadline: float) -> Any:
        told_to_stop = False
        while True:
            if not told_to_stop and not wanted():
                told_to_stop, deadline = True, min(deadline, time.monotonic() + STOP_S)
                self._send(child.CANCEL, {"number": self._number})
            if time.monotonic() > deadline:
                raise JobStopped if told_to_stop else JobTimeout
            kind, body = self._receive(LOOK_S)
            if kind == child.BEGUN:
                self._begun = True
            elif kind == child.PROGRESS:
                report(body["fraction"], body["message"])
            elif kind == child.RESULT:
                return body
            elif kind == child.PROBLEM:
                raise JobFailed(body)

    def _start(self) -> None:
        """A living process that has said it is ready."""
        with self._lock:
            if self._closed:
                raise WorkerDied
            if self.pid is not None:
                return
            self._dispose()
            self._line, theirs = socket.socketpair()
            # A session of its own: an operator's Ctrl-C is for the server, which then ends its workers. Our settings
            # may hold a token, for which a worker has no use.
            environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE_TOKEN")} | ONE_THREAD
            with theirs:
                self._process = subprocess.Popen(
                    [sys.executable, "-P", str(Path(child.__file__)), json.dumps(sys.path), json.dumps(self._modules),
                     str(self._memory_bytes)], env=environment, stdin=theirs, stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL, start_new_session=True)
        if self._receive(START_S)[0] != child.READY:
            raise WorkerDied

    def _send(self, kind: int, value: Any) -> None:
        text = json.dumps(value, allow_nan=False).encode("ascii")
        self._line.settimeout(START_S)  # it listens beside its work; only one that is stopped takes longer
        self._line.sendall(child.HEADER.pack(kind, len(text)) + text)

    def _receive(self, seconds: float) -> tuple[int | None, Any]:
        """The next message, (None, None) where none came in time."""
        self._line.settimeout(seconds)
        while True:
            head = self._unread[:child.HEADER.size]
            if len(head) == child.HEADER.size:
                kind, length = child.HEADER.unpack(head)
                if length > MAX_ANSWER_BYTES:
                    raise WorkerDied
                end = child.HEADER.size + length
                if len(self._unread) >= end:
                    body = bytes(self._unread[child.HEADER.size:end])
                    del self._unread[:end]
                    return kind, json.loads(body)
            try:
                part = self._line.recv(1 << 20)
            except TimeoutError:
                return None, None
            if not part:
                raise WorkerDied
            self._unread += part

    def drop(self) -> None:
        """The process is of no more use; only for who runs jobs on it."""
        with self._lock:
            self._dispose()

    def _dispose(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._line is not None:
            self._line.close()
        self._process, self._line = None, None
        self._unread.clear()
