"""What fifty browsers wait for: python tests/bench/bench_browsers.py [SECONDS] [OTHER_CHECKOUT …]

Each has a live picture and asks for one thing after the other, with 1.8 s between them: answers about versions, lists,
states, pictures, and after each of its operator's clicks the whole fit. Four simulated cameras; one of their processes
is killed in the middle. This checkout and the others take turns, twice; printed is how long each kind of call took.
"""

import asyncio
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import requests
from websockets.asyncio.client import connect

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.activation import activate_despite
from tests.support.child_processes import family
from tests.support.paths import ROOT
from tests.support.rig_over_field import REGIONS, sim_task
from tests.support.waiting import until

BROWSERS, CAMERAS, TURNS = 50, 4, 2
PAUSE_S = 1.8
WARM_SHARE = 0.1  # of the time: not counted
SOURCE = "sim://ssl-div-b?cameras=4&camera={}&lens=half&tilt=6&fill=0.86&seed=1&robots=4&fps=15"
FITS = {"fit/attempt": 14, "save": 1}
READS = {
    "mesh": 10,
    "overlay": 10,
    "report": 8,
    "picture": 10,
    "brief list": 8,
    "cameras": 8,
    "status": 18,
    "transform": 8,
    "health": 5,
}


class World:
    """A server of one checkout, with cameras, versions and pictures."""

    def __init__(self, url: str, pid: int) -> None:
        self.url, self.pid = url, pid
        self.clicks = [sim_task(CAMERAS, i).to_json() for i in range(CAMERAS)]
        self.versions = [
            self.ask("POST", "/calibrations", self.body(i, {"model": "brown-conrady"}))["id"]
            for i in range(CAMERAS)
        ]
        for id in self.versions:
            activate_despite(url, id)
        until(
            lambda: all(
                one["state"] == "live" for one in self.ask("GET", "/cameras/status")["items"]
            ),
            bool,
        )
        self.pictures = [
            self.ask("POST", "/snapshots", {"camera": f"cam{i}"})["id"] for i in range(CAMERAS)
        ]

    def body(self, i: int, more: dict) -> dict:
        return {
            "camera": f"cam{i}",
            "field": "ssl-div-b",
            "region": REGIONS[CAMERAS][i],
            "image_size": self.clicks[i]["image_size"],
            "observations": self.clicks[i]["observations"],
            **more,
        }

    def ask(self, method: str, path: str, body: dict | None = None) -> dict:
        answer = requests.request(method, f"{self.url}/api/v1{path}", json=body, timeout=60)
        answer.raise_for_status()
        return answer.json()


class Browser:
    """One operator's page: what it asks for, and the clicks, of which each fit has one moved."""

    def __init__(self, world: World, number: int) -> None:
        self.world, self.random = world, random.Random(number)
        self.camera = number % CAMERAS
        # half of them have no lens model chosen, half the first one of the list
        few = [
            one for one in world.clicks[self.camera]["observations"] if len(one["points"]) >= 12
        ][:4]
        self.body = world.body(
            self.camera,
            {
                "model": ("auto", "polynomial")[number // CAMERAS % 2],
                "observations": json.loads(json.dumps(few)),
            },
        )

    def request(self, kind: str) -> tuple[str, str, dict | None]:
        """Return method, path and body of the next call of a kind."""
        version = f"/calibrations/{self.random.choice(self.world.versions)}"
        if kind in FITS:
            points = self.random.choice(self.body["observations"])["points"]
            moved = self.random.randrange(len(points))
            points[moved] = [x + self.random.gauss(0, 0.2) for x in points[moved]]
            return "POST", "/fit/attempt" if kind == "fit/attempt" else "/calibrations", self.body
        return {
            "mesh": ("GET", f"{version}/mesh", None),
            "overlay": ("GET", f"{version}/overlay.json", None),
            "report": ("GET", f"{version}/report.json", None),
            "picture": (
                "GET",
                f"/snapshots/{self.random.choice(self.world.pictures)}/image.jpg?width=640",
                None,
            ),
            "brief list": ("GET", "/calibrations?brief=true", None),
            "cameras": ("GET", "/cameras", None),
            "status": ("GET", "/cameras/status", None),
            "health": ("GET", "/health", None),
            "transform": (
                "POST",
                f"{version}/transform",
                {"from": "image", "to": "field", "points": [[300, 200]] * 20},
            ),
        }[kind]

    async def live(self) -> None:
        """Watch a live picture, twice a second, and begin again where it ends."""
        to = self.world.url.replace("http", "ws")
        while True:
            with suppress(OSError, Exception):
                async with connect(
                    f"{to}/api/v1/cameras/cam{self.camera}/stream?width=320&fps=2&ack=true",
                    max_size=None,
                ) as line:
                    async for _ in line:
                        await line.send("next")
            await asyncio.sleep(1)

    async def work(
        self, seconds: float, took_s: dict[str, list[float]], answers: Counter[int]
    ) -> None:
        """Ask until then, on one connection that is kept."""
        kinds = READS | FITS
        host, port = self.world.url.removeprefix("http://").split(":")
        reader, writer = await asyncio.open_connection(host, int(port), limit=1 << 24)
        begun, last = time.monotonic(), time.monotonic() + seconds
        try:
            while True:
                await asyncio.sleep(self.random.expovariate(1 / PAUSE_S))
                if time.monotonic() > last:
                    return
                kind = self.random.choices(list(kinds), list(kinds.values()))[0]
                method, path, body = self.request(kind)
                data = b"" if body is None else json.dumps(body).encode()
                asked = time.monotonic()
                writer.write(
                    f"{method} /api/v1{path} HTTP/1.1\r\nHost: {host}:{port}\r\nX-Operator: {id(self)}\r\n"
                    f"Content-Type: application/json\r\nContent-Length: {len(data)}\r\n\r\n".encode()
                    + data
                )
                head = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
                await reader.readexactly(
                    int(head.partition("content-length: ")[2].split("\r\n")[0])
                )
                if asked - begun > WARM_SHARE * seconds:
                    took_s[kind].append(time.monotonic() - asked)
                    answers[int(head.split()[1])] += 1
        finally:
            writer.close()


async def crowd(world: World, seconds: float) -> tuple[dict[str, list[float]], Counter[int]]:
    took_s: dict[str, list[float]] = defaultdict(list)
    answers: Counter[int] = Counter()
    browsers = [Browser(world, i) for i in range(BROWSERS)]
    watching = [asyncio.create_task(browser.live()) for browser in browsers]
    asyncio.get_running_loop().call_later(seconds / 2, kill_a_camera, world.pid)
    await asyncio.gather(*(browser.work(seconds, took_s, answers) for browser in browsers))
    for task in watching:
        task.cancel()
    await asyncio.gather(*watching, return_exceptions=True)
    return took_s, answers


def kill_a_camera(server: int) -> None:
    victim = next(pid for pid, line in family(server).items() if "touchline.live." in line)
    os.kill(victim, signal.SIGKILL)


@contextmanager
def served(checkout: Path) -> Iterator[World]:
    """Serve with one checkout's code."""
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder, "settings.yaml")
        settings.write_text(
            "server: {port: 0}\ncameras:\n"
            + "".join(
                f"- {{id: cam{i}, source: '{SOURCE.format(i)}', field: ssl-div-b, region: {REGIONS[CAMERAS][i]}}}\n"
                for i in range(CAMERAS)
            )
        )
        server = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "from touchline.cli import main; main()",
                "serve",
                "--config",
                settings,
                "--data",
                Path(folder, "data"),
            ],
            cwd=checkout,
            env=os.environ | {"PYTHONPATH": str(checkout / "app")},
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert server.stdout is not None
            yield World(server.stdout.readline().split()[-1].rstrip("/"), server.pid)
        finally:
            server.terminate()
            server.wait(30)


def processor_s(server: int) -> float:
    """Return the processor time of the server and what it has started, without those that have ended."""
    ticks = 0
    for pid in family(server):
        with suppress(OSError):
            ticks += sum(
                map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13])
            )
    return ticks / os.sysconf("SC_CLK_TCK")


def show(name: str, took_s: list[float]) -> None:
    p50, p95, p99 = 1000 * np.percentile(took_s, [50, 95, 99])
    print(f"  {name:14} {len(took_s):5} calls  p50 {p50:7.0f}  p95 {p95:7.0f}  p99 {p99:7.0f} ms")


def main() -> None:
    numbers = [float(text) for text in sys.argv[1:] if text.replace(".", "").isdigit()]
    seconds = numbers[0] if numbers else 120.0
    checkouts = [
        ROOT,
        *(Path(text).resolve() for text in sys.argv[1:] if not text.replace(".", "").isdigit()),
    ]
    for turn in range(TURNS):
        for checkout in checkouts:
            with served(checkout) as world:
                before = processor_s(world.pid)
                took_s, answers = asyncio.run(crowd(world, seconds))
                used = processor_s(world.pid) - before
            rate = sum(answers.values()) / seconds / (1 - WARM_SHARE)
            print(
                f"{checkout}, turn {turn + 1}: {rate:.1f} calls a second, {used / seconds:.2f} processors, "
                f"load {os.getloadavg()[0]:.1f}, answers {dict(answers)}"
            )
            for kind in sorted(took_s):
                show(kind, took_s[kind])
            for name, kinds in (("all but fits", READS), ("fits", FITS)):
                show(name, [s for kind in kinds for s in took_s[kind]])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
