"""Mixed traffic for half an hour. Command: python -m pytest tests/bench/bench_traffic.py -s

Ten pages that go from view to view, four cameras with calibrations, somebody who asks for all that is costly, and a
fault every minute; beside them somebody who asks for the cameras' states ten times a second. Prints how soon those
answers came beside each costly call, and how memory, descriptors, threads and children have grown; answers of 5xx
must be none. TOUCHLINE_TRAFFIC_MIN: how many minutes, 30.
"""

import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections import Counter, defaultdict
from contextlib import suppress
from itertools import cycle
from pathlib import Path
from threading import Event, Thread
from urllib.parse import urlsplit

import numpy as np
import pytest
import requests
from playwright.sync_api import sync_playwright
from websockets.sync.client import connect

from tests.support.activation import activate_despite
from tests.support.child_processes import family
from tests.support.chromium import ARGUMENTS, chromium_path
from tests.support.paths import ROOT
from tests.support.rig_over_field import REGIONS, sim_task
from tests.support.waiting import until
from touchline.images import encode

MINUTES = float(os.environ.get("TOUCHLINE_TRAFFIC_MIN", "30"))
WARM_S = 120.0  # until every page, process and cache is there
PAGES, CAMERAS = 10, 4
VIEWS = [
    "cameras",
    "cameras/cam0/live",
    "cameras/cam1/versions",
    "cameras/cam2/drift",
    "cameras/cam3/detection",
    "library/images",
    "system/server",
    "system/jobs",
    "system/publishing",
    "rigs/hall",
]
PROBE_S = 0.1
SOURCE = "sim://ssl-div-b?cameras=4&camera={}&lens=half&tilt=6&fill=0.86&seed=1&robots=4&fps=15"


def sizes(pid: int) -> dict[str, float]:
    """What the server and all below it take now."""
    processes, resident = family(pid), 0
    for one in processes:
        with suppress(OSError):
            lines = Path(f"/proc/{one}/smaps_rollup").read_text().splitlines()
            resident += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    own = sum(
        int(line.split()[1])
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
        if line.startswith("Rss:")
    )
    return {
        "server MB": own / 1000,
        "all MB": resident / 1000,
        "descriptors": len(os.listdir(f"/proc/{pid}/fd")),
        "threads": len(os.listdir(f"/proc/{pid}/task")),
        "children": len(processes) - 1,
    }


class Traffic:
    """A server, and everything that is asked of it. answers: how many of each status, by call."""

    def __init__(self, url: str, pid: int) -> None:
        self.url, self.api, self.pid = url, f"{url}/api/v1", pid
        self.answers: Counter[tuple[str, int]] = Counter()
        self.latencies: dict[str, list[float]] = defaultdict(list)
        self.beside = "nothing"
        self.ended = Event()
        self.random = random.Random(1)

    def ask(
        self, method: str, path: str, timeout_s: float = 120.0, **more
    ) -> requests.Response | None:
        """Ask, and note the status; None where nobody waited so long."""
        name = f"{method} {path.split('?')[0]}"
        try:
            answer = requests.request(method, self.api + path, timeout=timeout_s, **more)
        except requests.Timeout:
            return None
        self.answers[name, answer.status_code] += 1
        if answer.status_code >= 500:
            print(name, answer.status_code, answer.text[:300])
        return answer

    def probe(self) -> None:
        while not self.ended.wait(PROBE_S):
            begun, beside = time.monotonic(), self.beside
            self.ask("GET", "/cameras/status")
            self.latencies[beside].append(time.monotonic() - begun)

    def costly(self) -> None:
        """Ask for one costly thing after the other, some by callers who leave at once."""
        noise = np.random.default_rng(1).integers(0, 255, (1800, 2400, 3), np.uint8)
        picture = encode(noise, "jpg")
        uploaded = self.ask("POST", "/snapshots", files={"file": picture}).json()["id"]
        shots = [
            self.ask("POST", "/snapshots", json={"camera": f"cam{i}"}).json()["id"]
            for i in range(CAMERAS)
        ]
        versions = self.ask("GET", "/calibrations?brief=true").json()["items"]
        points = np.random.default_rng(1).uniform(0, 700, (1_000_000, 2)).astype("<f8").tobytes()
        clicks = json.loads(json.dumps(sim_task(CAMERAS, 0).to_json()))
        body = {
            "field": "ssl-div-b",
            "region": REGIONS[CAMERAS][0],
            "image_size": clicks["image_size"],
            "observations": clicks["observations"],
        }
        version = versions[0]["id"]
        calls = {
            "stitched": lambda: self.ask("GET", "/rigs/hall/stitched.jpg?width=2400"),
            "stitched, left": lambda: self.ask("GET", "/rigs/hall/stitched.jpg?width=2400", 0.2),
            "enlarged": lambda: self.ask(
                "GET", f"/calibrations/{version}/corrected.png?snapshot={shots[0]}&width=4000"
            ),
            "a million points": lambda: self.ask(
                "POST",
                f"/calibrations/{version}/transform?from=image&to=field",
                data=points,
                headers={"Content-Type": "application/octet-stream"},
            ),
            "detections": lambda: self.ask(
                "POST", "/detections", json={"snapshot": shots[2], "calibration": versions[1]["id"]}
            ),
            "straightness": lambda: self.ask(
                "POST", "/straightness", json={"snapshots": [uploaded]}
            ),
            "find lines": lambda: self.finish(
                "/calibrations/auto",
                {"snapshot": shots[1], "field": "ssl-div-b", "region": REGIONS[CAMERAS][1]},
            ),
            "comparison": lambda: self.ask("POST", "/calibrations/compare", json=body),
            "rig check": lambda: self.ask("POST", "/rigs/hall/check", json={"pictures": "live"}),
            "report": lambda: self.ask("GET", f"/calibrations/{version}/report.html"),
            "scene": lambda: self.ask("GET", f"/calibrations/{version}/scene.html"),
            "archive": lambda: self.ask("GET", "/archive"),
            "save": lambda: self.ask(
                "POST", "/calibrations", json={**body, "model": "division", "camera": "cam0"}
            ),
            "nothing": lambda: self.ended.wait(3.0),
        }
        for self.beside in cycle(calls):
            if self.ended.is_set():
                return
            calls[self.beside]()

    def finish(self, path: str, body: dict) -> None:
        """Start a job, and wait for its end."""
        job = self.ask("POST", path, json=body).json()
        while not self.ended.wait(0.3) and job.get("state") in ("queued", "running"):
            job = self.ask("GET", f"/jobs/{job['id']}").json()

    def fault(self, number: int) -> str:
        """Do one harm, and say which."""
        place = urlsplit(self.url)
        kind = (
            "camera dies",
            "job dies",
            "hostile pictures",
            "garbage",
            "sockets cut",
            "half a request",
            "a camera is knocked",
        )[number % 7]
        if kind in ("camera dies", "job dies"):
            module = "touchline.live." if kind == "camera dies" else "touchline.jobs."
            for pid in [pid for pid, line in family(self.pid).items() if module in line][:1]:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        elif kind == "hostile pictures":
            for path in sorted((ROOT.parent / "shared" / "data" / "hostile_images").glob("*.*"))[
                :40
            ]:
                self.ask("POST", "/snapshots", files={"file": path.read_bytes()})
        elif kind == "garbage":
            for data in (b"\x00" * 4096, b"GET / HTTP/1.1\r\nHost: [\r\n\r\n", os.urandom(4096)):
                with socket.create_connection((place.hostname, place.port)) as line:
                    line.sendall(data)
        elif kind == "sockets cut":
            for _ in range(30):
                line = connect(f"ws://{place.netloc}/api/v1/cameras/cam0/stream?view=raw&width=320")
                line.socket.shutdown(socket.SHUT_RDWR)
        elif kind == "half a request":
            self.half = [socket.create_connection((place.hostname, place.port)) for _ in range(30)]
            for line in self.half:
                line.sendall(
                    b"POST /api/v1/snapshots HTTP/1.1\r\nHost: x\r\nContent-Length: 100000\r\n\r\nxx"
                )
        else:
            self.ask(
                "PATCH",
                "/cameras/cam1/controls",
                json={"controls": {"knock": 4 * (number // 7 % 2)}},
            )
        return kind

    def walk(self, until_s: float) -> tuple[list[dict[str, float]], list[str]]:
        """Let the pages go from view to view, measure, and do harm, until then."""
        samples, errors, faults, begun = [], [], 0, time.monotonic()
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
            pages = [
                browser.new_page(viewport={"width": 1024, "height": 700}) for _ in range(PAGES)
            ]
            for page in pages:
                page.on("pageerror", lambda error: errors.append(str(error)))
            for number, page in enumerate(cycle(pages)):
                if time.monotonic() > until_s:
                    break
                page.goto(f"{self.url}/#/{self.random.choice(VIEWS)}")
                page.wait_for_timeout(1000)
                if number % 10 == 0:
                    samples.append({"s": time.monotonic() - begun, **sizes(self.pid)})
                if time.monotonic() - begun > 60 * (faults + 1):
                    print(
                        f"{time.monotonic() - begun:.0f} s: {self.fault(faults)}; {samples[-1]}",
                        flush=True,
                    )
                    faults += 1
            browser.close()
        return samples, errors


@pytest.fixture
def traffic(tmp_path):
    (tmp_path / "settings.yaml").write_text(
        "server: {port: 0}\ncameras:\n"
        + "".join(
            f"- {{id: cam{i}, source: '{SOURCE.format(i)}', field: ssl-div-b, region: {REGIONS[CAMERAS][i]}}}\n"
            for i in range(CAMERAS)
        )
    )
    with (tmp_path / "log").open("w") as log:
        server = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "from touchline.cli import main; main()",
                "serve",
                "--config",
                str(tmp_path / "settings.yaml"),
                "--data",
                str(tmp_path / "data"),
            ],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
        it = Traffic(server.stdout.readline().split()[-1].rstrip("/"), server.pid)
        for i in range(CAMERAS):
            clicks = sim_task(CAMERAS, i).to_json()
            made = it.ask(
                "POST",
                "/calibrations",
                json={
                    "camera": f"cam{i}",
                    "field": "ssl-div-b",
                    "region": REGIONS[CAMERAS][i],
                    "model": "brown-conrady",
                    "image_size": clicks["image_size"],
                    "observations": clicks["observations"],
                },
            ).json()
            activate_despite(it.url, made["id"])
        it.ask(
            "PUT",
            "/rigs/hall",
            json={
                "title": "Hall",
                "field": "ssl-div-b",
                "cameras": [
                    {"camera": f"cam{i}", "region": REGIONS[CAMERAS][i]} for i in range(CAMERAS)
                ],
            },
        )
        until(
            lambda: it.ask("POST", "/snapshots", json={"camera": "cam3"}),
            lambda said: said.status_code == 201,
        )
        yield it
        server.terminate()
        server.wait(20)
    print((tmp_path / "log").read_text()[-2000:])


def test_half_an_hour_of_everything_leaves_nothing_behind(traffic):
    others = [Thread(target=traffic.probe), Thread(target=traffic.costly)]
    for other in others:
        other.start()
    samples, errors = traffic.walk(time.monotonic() + 60 * MINUTES)
    traffic.ended.set()
    for other in others:
        other.join()
    warm = [one for one in samples if one["s"] > WARM_S]
    hours = np.array([one["s"] for one in warm]) / 3600
    for name in list(samples[0])[1:]:
        values = np.array([one[name] for one in warm])
        slope = np.polyfit(hours, values, 1)[0]
        print(
            f"{name}: {values[0]:.0f} → {values[-1]:.0f}, at most {values.max():.0f}, {slope:+.1f} an hour"
        )
    for beside, found in sorted(traffic.latencies.items()):
        ms = 1000 * np.array(found)
        print(
            f"beside {beside}: {len(ms)} answers, median {np.median(ms):.0f} ms, p99 {np.percentile(ms, 99):.0f}"
        )
    everything = 1000 * np.concatenate([np.array(found) for found in traffic.latencies.values()])
    print(
        f"all: p99 {np.percentile(everything, 99):.0f} ms, worst {everything.max():.0f}; page errors: {errors}"
    )
    print({call: count for call, count in sorted(traffic.answers.items()) if call[1] >= 400})
    assert not [call for call in traffic.answers if call[1] >= 500] and not errors
