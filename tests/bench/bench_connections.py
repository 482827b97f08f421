"""How long this machine and a token holder wait while other machines hold all the connections that they can get.

python tests/bench/bench_connections.py

Ten machines with 40 half-sent heads each, then 500 idle connections of 20 machines, then 300 WebSockets of one machine
that has the token. Every loopback address but 127.0.0.1 counts as another machine.
"""

import resource
import socket
import statistics
import subprocess
import sys
import time

OURS, TOKEN = "127.0.0.1", "0123456789abcdef0123"
CALLS = 100
REQUEST = "GET /api/v1/cameras HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {token}\r\n{more}\r\n"
UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
SERVER = """
import sys, tempfile
from pathlib import Path
from touchline.api.middleware import connections
connections._is_this_machine = lambda address: address == "127.0.0.1"
from touchline.main import serve
from touchline.settings import Settings
with tempfile.TemporaryDirectory() as folder:
    serve(Settings(data=Path(folder), token=sys.argv[1], server={"host": "0.0.0.0", "port": int(sys.argv[2])}))
"""


def connect(address: str, port: int, text: str = "") -> socket.socket | None:
    try:
        line = socket.create_connection((OURS, port), timeout=10, source_address=(address, 0))
        line.sendall(text.encode())
        return line
    except OSError:
        return None


def answered(address: str, port: int, token: str) -> tuple[int, float]:
    """Return the status of one request on a new connection, 0 for none, and ms until then."""
    begin, status = time.monotonic(), 0
    if (
        line := connect(address, port, REQUEST.format(token=token, more="Connection: close\r\n"))
    ) is not None:
        with line:
            try:
                status = int(line.recv(65536).split()[1])
            except (OSError, IndexError):
                status = 0
    return status, 1000 * (time.monotonic() - begin)


def nobody(port: int) -> list[socket.socket | None]:
    return []


def half_sent(port: int) -> list[socket.socket | None]:
    return [
        connect(f"127.0.1.{machine}", port, "GET / HTTP/1.1\r\nHost:")
        for machine in range(10)
        for _ in range(40)
    ]


def idle(port: int) -> list[socket.socket | None]:
    return [
        connect(f"127.0.2.{number % 20}", port, REQUEST.format(token="", more=""))
        for number in range(500)
    ]


def sockets(port: int) -> list[socket.socket | None]:
    asked = REQUEST.replace("/cameras", "/jobs/stream").format(token=TOKEN, more=UPGRADE)
    return [connect("127.0.3.1", port, asked) for _ in range(300)]


def main() -> None:
    resource.setrlimit(
        resource.RLIMIT_NOFILE, (4096, resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    )
    with socket.create_server((OURS, 0)) as free:
        port = free.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER, TOKEN, str(port)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert server.stdout is not None and "running" in server.stdout.readline()
        for attack in (nobody, half_sent, idle, sockets):
            held = attack(port)
            for name, address in (("this machine", OURS), ("token holder", "127.0.4.1")):
                found = [answered(address, port, TOKEN) for _ in range(CALLS)]
                times, good = [ms for _, ms in found], sum(status == 200 for status, _ in found)
                print(
                    f"{attack.__name__:12} {name:13} answered {good:3} of {CALLS}, median "
                    f"{statistics.median(times):5.1f} ms, most {max(times):6.1f} ms",
                    flush=True,
                )
            for line in held:
                if line is not None:
                    line.close()
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
