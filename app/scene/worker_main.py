"""The process of one scene: viser and all that it draws, on one line to the server; gone when the line is.

Started by path, as a camera's process is, but behind everything else: whoever looks at a scene can wait.
"""

import json
import os
import socket
import sys

MEMORY_BYTES = 6 << 30  # of addresses: viser's threads reserve much more than they use
NICE = 10


def main() -> None:
    """Serve standard input, a socket, until it closes. Argument: the paths for imports, as JSON."""
    sys.path[:] = json.loads(sys.argv[1])
    from app.processes.framing import confine
    os.nice(NICE)
    confine(MEMORY_BYTES)
    import cv2
    cv2.setNumThreads(1)
    from app.live.worker_main import Line
    from app.scene.worker_server import Serving
    Serving(Line(socket.socket(fileno=0))).run()


if __name__ == "__main__":
    main()
