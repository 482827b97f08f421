"""How long POST /fit/border takes with 30 points, over loopback, from a real server in a process of its own.

    .venv/bin/python tests/bench/bench_fit_border.py

Prints the median, 95th and 99th percentile of RUNS requests on one kept-alive connection, for each degree.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

ROOT = Path(__file__).parents[2]
RUNS, WARM_UP = 500, 30
START = "from touchline.cli import main; main()"


def started_server(data: str) -> tuple[subprocess.Popen, str]:
    """A server on a free port, and its address."""
    server = subprocess.Popen(
        [sys.executable, "-c", START, "serve", "--port", "0", "--data", data],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    assert server.stdout is not None
    return server, server.stdout.readline().split()[-1]


def clicks(count: int = 30) -> list[list[float]]:
    """A left border under a barrel lens, clicked to half a pixel."""
    rng = np.random.default_rng(1)
    y = np.linspace(20, 1060, count)
    x = 160 - 60 * (1 - ((y - 540) / 540) ** 2) + rng.normal(0, 0.4, count)
    return np.stack([x, y], axis=1).round(2).tolist()


def times_ms(url: str, degree: int | str) -> np.ndarray:
    """Milliseconds of each of RUNS requests, answer read."""
    body = json.dumps(
        {"points": clicks(), "axis": "x_of_y", "degree": degree, "image_size": [1920, 1080]}
    )
    line = HTTPConnection(urlsplit(url).netloc)
    times = []
    for _ in range(WARM_UP + RUNS):
        start = time.perf_counter()
        line.request("POST", "/api/v1/fit/border", body, {"Content-Type": "application/json"})
        answer = line.getresponse()
        content = answer.read()
        times.append(1e3 * (time.perf_counter() - start))
        assert answer.status == 200, content
    return np.array(times[WARM_UP:])


def main() -> None:
    with tempfile.TemporaryDirectory() as data:
        server, url = started_server(data)
        try:
            for degree in (3, "auto"):
                p50, p95, p99 = np.percentile(times_ms(url, degree), (50, 95, 99))
                print(
                    f"POST /fit/border, 30 points, degree {degree}: p50 {p50:.2f} ms, p95 {p95:.2f} ms, "
                    f"p99 {p99:.2f} ms ({RUNS} requests)"
                )
        finally:
            server.send_signal(signal.SIGTERM)
            server.wait(10)


if __name__ == "__main__":
    main()
