"""The process that does jobs, one after another: each a function found by its name, whatever comes of it.

Bodies of messages are JSON; the number is the job's. To it: RUN {"run": "module:function", "spec"} and CANCEL. From it,
for each job: BEGUN, PROGRESS {"fraction", "message"}, then RESULT or PROBLEM, whose payload is JSON: some only pass it
on.
"""

import json
import queue
import threading
import time
import traceback
from importlib import import_module
from typing import Any

from touchline.core.errors import Cancelled, TouchlineError
from touchline.core.jobs import Progress, problem_of
from touchline.core.json_values import finite_json
from touchline.core.registry import load
from touchline.core.statements import stated
from touchline.processes.framing import FIRST_KIND, START, Connection, decode_body, encode_body

RUN, CANCEL, BEGUN, PROGRESS, RESULT, PROBLEM = range(FIRST_KIND, FIRST_KIND + 6)
MIN_INTERVAL_S = 0.05  # between two reports of progress; more often nobody sees


def execute(run: str, spec: Any, progress: Progress) -> tuple[bool, Any]:
    """Return (True, what the function returned) or (False, its problem as JSON); run is "module:function".

    Nothing is raised: an exception of ours, or of a library, may not be one that the server can read.
    """
    try:
        return True, load(run)(spec, progress)
    except TouchlineError as error:
        return False, problem_of(error)
    except MemoryError:
        return False, {"reason": "job-needs-memory"}
    except (Exception, SystemExit):
        return False, {"reason": "unexpected", "trace": traceback.format_exc()[-4000:]}


def main(connection: Connection, arguments: dict[str, Any]) -> None:
    """Serve until the server goes.

    arguments: {"modules"} that jobs will need: a cancelled one has no time to import.
    """
    for module in arguments["modules"]:
        import_module(module)
    JobWorker(connection).serve()


class JobWorker:
    """One connection, and the jobs that come over it."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._queue: queue.SimpleQueue[tuple[int, dict[str, Any]]] = queue.SimpleQueue()
        self._cancelled = -1  # number of the job that is to stop
        self._reported_at, self._reported = 0.0, ""

    def serve(self) -> None:
        threading.Thread(target=self._listen, daemon=True).start()
        self._send(START, 0, {})
        while True:
            self._do(*self._queue.get())

    def _do(self, number: int, job: dict[str, Any]) -> None:
        def progress(fraction: float, message: str) -> None:
            if self._cancelled == number:
                raise Cancelled("The job was cancelled.", "Start it again.")
            now = time.monotonic()
            if message != self._reported or now - self._reported_at >= MIN_INTERVAL_S:
                self._reported_at, self._reported = now, message
                self._send(
                    PROGRESS, number, stated({"fraction": float(fraction), "message": message})
                )

        self._send(BEGUN, number, {})
        is_done, value = execute(job["run"], job["spec"], progress)
        text = json.dumps(finite_json(value), allow_nan=False, separators=(",", ":"))
        self._send(RESULT if is_done else PROBLEM, number, {}, text.encode("ascii"))

    def _listen(self) -> None:
        """Receive while a job runs."""
        while True:
            kind, number, body = self._connection.receive()
            if kind == RUN:
                self._queue.put((number, decode_body(body)[0]))
            else:
                self._cancelled = number

    def _send(self, kind: int, number: int, value: dict[str, Any], payload: bytes = b"") -> None:
        self._connection.send(kind, number, encode_body(finite_json(value), payload))
