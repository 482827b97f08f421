"""The beginning of every child process: imports, limits and signals, then the function that it was started for.

Started by path, so that what it imports is found where its parent finds it.
"""

import json
import os
import signal
import socket
import sys
from importlib import import_module


def main() -> None:
    """Serve standard input, a socket, until it closes. Argument: what start.py writes, as JSON."""
    start_up = json.loads(sys.argv[1])
    sys.path[:] = start_up["path"]
    # Signals that the parent ignores, as under nohup or in a shell's background, would be ignored here too.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    os.nice(start_up["nice"])
    from touchline.processes.framing import Connection, decode_body
    from touchline.processes.limits import limit

    if start_up["memory_bytes"] is not None:
        limit(start_up["memory_bytes"])
    import cv2

    cv2.setNumThreads(1)

    class ParentConnection(Connection):
        """The connection to the parent: without it there is nobody to work for."""

        def receive(self, timeout_s: float | None = None):
            try:
                return super().receive(timeout_s)
            except OSError:
                os._exit(0)

    connection = ParentConnection(socket.socket(fileno=0))
    arguments, _ = decode_body(connection.receive().body)
    module, _, function = start_up["main"].partition(":")
    getattr(import_module(module), function)(connection, arguments)


if __name__ == "__main__":
    main()
