"""Start a child process: in a session of its own, on one socket, without the server's secrets; a thread holds it."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

from touchline.processes.framing import MAX_BODY, START, Connection, encode_body

CHILD_MAIN = Path(__file__).with_name("child_main.py")
FRUGAL = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # of a thread's own arena the GNU library returns little of what was freed
    "MALLOC_ARENA_MAX": "1",
}
REAPER = "reaper of"
# our settings may hold a token or a database's password, for which a child has no use
SECRET = "TOUCHLINE"


@dataclass(frozen=True)
class Program:
    """What a child process runs.

    main: "module:function", called with the connection to its parent and its arguments, a dict of plain JSON.
    memory_bytes: of address space; None where main sets its own limits. nice: niceness.
    """

    main: str
    memory_bytes: int | None = None
    nice: int = 0


class Child(subprocess.Popen[bytes]):
    """A process whose end is collected at once, also where nobody asks for it any more."""

    _reaper: Thread | None = None

    def collect_soon(self) -> None:
        """Collect it in a thread of its own, or, where no thread is to be had, when somebody looks for it."""
        reaper = Thread(target=self._collect, name=f"{REAPER} {self.pid}", daemon=True)
        with suppress(RuntimeError):
            reaper.start()
            self._reaper = reaper

    def wait(self, timeout: float | None = None) -> int:
        """Wait until it has ended and nothing of it is left, no thread either."""
        code = super().wait(timeout)
        if self._reaper is not None:
            self._reaper.join()
        return code

    def _collect(self) -> None:
        with suppress(ChildProcessError):  # another thread was faster
            # Not wait(): it holds the lock all the while without which poll() of other threads cannot tell.
            os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)
        self.poll()


def start(program: Program) -> tuple[Child, socket.socket]:
    """Return the process and the parent's end of the socket; OSError where none can be started."""
    ours, theirs = socket.socketpair()
    start_up = json.dumps(
        {
            "path": sys.path,
            "main": program.main,
            "memory_bytes": program.memory_bytes,
            "nice": program.nice,
        }
    )
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(SECRET)
    } | FRUGAL
    try:
        with theirs:
            # A session of its own: an operator's Ctrl-C is for the server, which then ends its children.
            process = Child(
                [sys.executable, "-P", str(CHILD_MAIN), start_up],
                env=environment,
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
    except OSError:
        ours.close()
        raise
    process.collect_soon()
    return process, ours


class ChildProcess:
    """One process from its start to its end, and the connection to it. Only end() may be called by other threads.

    arguments: plain JSON for its main. OSError where none can be started.
    """

    def __init__(
        self,
        program: Program,
        arguments: dict[str, Any],
        allocate: Callable[[int], Any] = bytearray,
        max_body: int = MAX_BODY,
    ) -> None:
        self._process, line = start(program)
        self.connection = Connection(line, allocate, max_body)
        try:
            self.connection.send(START, 0, encode_body(arguments))
        except OSError:
            self.close()
            raise

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        return self._process.poll() is None

    def await_ready(self, timeout_s: float) -> None:
        """Wait until it says that it is ready; OSError where it does not."""
        message = self.connection.receive(timeout_s)
        if message is None or message.kind != START:
            raise ConnectionResetError

    def end(self) -> None:
        """Kill it and wait until it is gone; whoever waits for its answer gets OSError."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Kill it, and close our end of the socket."""
        self.end()
        self.connection.close()
