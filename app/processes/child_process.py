"""A child process as a thread of its parent holds it."""

from collections.abc import Callable
from typing import Any

from app.processes.framing import MAX_BODY, START, Connection, encode_body
from app.processes.start import Program, start


class ChildProcess:
    """One process from its start to its end, and the connection to it. Only end() may be called by other threads.

    arguments: plain JSON for its main. OSError where none can be started.
    """

    def __init__(self, program: Program, arguments: dict[str, Any], allocate: Callable[[int], Any] = bytearray,
                 max_body: int = MAX_BODY) -> None:
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
