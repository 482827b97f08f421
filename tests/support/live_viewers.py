"""A crowd of viewers in a process of its own: some read all that comes, some nothing. Prints one line of JSON.

    python tests/support/live_viewers.py HOST PORT PATH READING MUTE SECONDS

Every second reader is a WebSocket, the others read MJPEG; the mute ones as well.
"""

import base64
import json
import os
import selectors
import socket
import sys
import time

UPGRADE = (
    "GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n"
)
PLAIN = "GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n"
SOI = b"\xff\xd8\xff"


def main() -> None:
    host, path, seconds = sys.argv[1], sys.argv[3], float(sys.argv[6])
    port, reading, mute = int(sys.argv[2]), int(sys.argv[4]), int(sys.argv[5])
    chooser = selectors.DefaultSelector()
    held, frames = [], {}
    for number in range(reading + mute):
        line = socket.create_connection((host, port))
        is_socket = number % 2 == 0
        form, to = (UPGRADE, path.replace("stream.mjpg", "stream")) if is_socket else (PLAIN, path)
        key = base64.b64encode(os.urandom(16)).decode()
        line.sendall(form.format(path=to, host=host, port=port, key=key).encode())
        held.append(line)
        if number < reading:
            line.setblocking(False)
            frames[line] = 0
            chooser.register(line, selectors.EVENT_READ, line)
    start = time.monotonic()
    total, buffer = 0, bytearray(1 << 20)
    while time.monotonic() - start < seconds:
        for ready, _ in chooser.select(0.5):
            count = ready.data.recv_into(buffer)
            if not count:
                chooser.unregister(ready.data)
                continue
            total += count
            frames[ready.data] += buffer[:count].count(SOI)
    took = time.monotonic() - start
    each = sorted(count / took for count in frames.values()) or [0.0]
    print(
        json.dumps(
            {"fps_median": each[len(each) // 2], "fps_least": each[0], "mb_s": total / took / 1e6}
        )
    )


if __name__ == "__main__":
    main()
