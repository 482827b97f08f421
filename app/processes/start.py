"""Start a child process: in a session of its own, on one socket, without the server's secrets."""

import json
import os
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

CHILD_MAIN = Path(__file__).with_name("child_main.py")
FRUGAL = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
          "MALLOC_ARENA_MAX": "1"}  # of a thread's own arena the GNU library returns little of what was freed
SECRET = "TOUCHLINE"  # our settings may hold a token or a database's password, for which a child has no use


@dataclass(frozen=True)
class Program:
    """What a child process runs.

    main: "module:function", called with the connection to its parent and its arguments, a dict of plain JSON.
    memory_bytes: of address space; None where main sets its own limits. nice: niceness.
    """

    main: str
    memory_bytes: int | None = None
    nice: int = 0


def start(program: Program) -> tuple[subprocess.Popen[bytes], socket.socket]:
    """Return the process and the parent's end of the socket; OSError where none can be started."""
    ours, theirs = socket.socketpair()
    start_up = json.dumps({"path": sys.path, "main": program.main, "memory_bytes": program.memory_bytes,
                           "nice": program.nice})
    environment = {name: value for name, value in os.environ.items() if not name.startswith(SECRET)} | FRUGAL
    try:
        with theirs:
            # A session of its own: an operator's Ctrl-C is for the server, which then ends its children.
            return subprocess.Popen([sys.executable, "-P", str(CHILD_MAIN), start_up], env=environment,
                                    stdin=theirs.fileno(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                    start_new_session=True), ours
    except OSError:
        ours.close()
        raise
