"""What live pictures cost the server. Command: python tests/bench/bench_live_cost.py [--seconds S] [CASE …]

The cameras are MJPEG over HTTP from another process: simulated ones rest when nobody looks, and render when somebody
does. Told: which share of the frames was read, and processor time of the server with its cameras' processes, in
processors. Cases: unwatched and watched (eight cameras, 1280 × 1024 at 30 a second; each with one viewer of its own
width), raw, corrected and side (eight viewers of one camera, 1920 × 1080), passing (one frame, without a server).
"""

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.request import Request, urlopen

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.activation import activate_despite
from tests.support.live_cameras import calibrated
from tests.support.waiting import until

ROOT = Path(__file__).parents[2]
TICK_S = 1 / os.sysconf("SC_CLK_TCK")
FPS = 30
SETTLE_S = 12.0
EIGHT, ONE = (8, "1280x1024"), (1, "1920x1080")


def asked(url: str, path: str, method: str = "GET", body: dict | None = None) -> dict:
    request = Request(
        f"{url}/api/v1{path}",
        json.dumps(body).encode() if body is not None else None,
        {"Content-Type": "application/json"},
        method=method,
    )
    with urlopen(request, timeout=60) as answer:
        return json.load(answer)


def family(pid: int) -> list[int]:
    """A process and all that it started."""
    found = [pid]
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):
            found += [
                one
                for child in (thread / "children").read_text().split()
                for one in family(int(child))
            ]
    return found


def spent_s(pid: int) -> float:
    """Processor time of a family so far, s."""
    total = 0.0
    for one in family(pid):
        with contextlib.suppress(OSError):
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
            total += (int(fields[11]) + int(fields[12])) * TICK_S
    return total


@contextlib.contextmanager
def served(count: int, size: str) -> Iterator[tuple[str, int, list[str]]]:
    """A server whose cameras are another process': (its address, its pid, the cameras' ids)."""
    sender = subprocess.Popen(
        [sys.executable, "-m", "tests.support.mjpeg_sender", str(count), size, str(FPS)],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    told = json.loads(sender.stdout.readline())
    print(f"  {count} × {size}, {told['kb']:.0f} kB a frame")
    with tempfile.TemporaryDirectory() as folder:
        ids = [f"c{i}" for i in range(count)]
        cameras = "".join(
            f"- {{id: {id}, source: '{url}', field: table, region: full}}\n"
            for id, url in zip(ids, told["urls"], strict=True)
        )
        settings = Path(folder) / "settings.yaml"
        settings.write_text(
            f"server: {{port: 0}}\nsources: {{allowed_hosts: [127.0.0.1]}}\ncameras:\n{cameras}"
        )
        server = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "from touchline.cli import main; main()",
                "serve",
                "--config",
                str(settings),
                "--data",
                str(Path(folder) / "data"),
            ],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        url = server.stdout.readline().split()[-1].rstrip("/")
        try:
            for id in ids:  # a camera starts when it is first asked for
                until(
                    lambda id=id: asked(url, f"/cameras/{id}/status")["state"],
                    lambda state: state == "live",
                )
            yield url, server.pid, ids
        finally:
            server.terminate()
            server.wait(30)
            sender.stdin.close()
            sender.wait(30)


def measured(url: str, pid: int, ids: list[str], seconds: float) -> tuple[float, float]:
    """Share of the frames read, and processors, over so long."""

    def seqs() -> list[int]:
        return [asked(url, f"/cameras/{id}/status")["seq"] for id in ids]

    time.sleep(SETTLE_S)
    before, spent, begun = seqs(), spent_s(pid), time.monotonic()
    time.sleep(seconds)
    after, took = seqs(), time.monotonic() - begun
    share = float(np.mean([b - a for a, b in zip(before, after, strict=True)])) / took / FPS
    return share, (spent_s(pid) - spent) / took


@contextlib.contextmanager
def viewers(url: str, paths: list[str], seconds: float) -> Iterator[list[subprocess.Popen]]:
    host, port = url.removeprefix("http://").split(":")
    all = [
        subprocess.Popen(
            [
                sys.executable,
                "-m",
                "tests.support.live_viewers",
                host,
                port,
                f"/api/v1{path}",
                "1",
                "0",
                str(seconds + SETTLE_S + 3),
            ],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        for path in paths
    ]
    yield all
    for one in all:
        one.wait(120)


def eight(seconds: float, watched: bool) -> None:
    with served(*EIGHT) as (url, pid, ids):
        paths = [f"/cameras/{id}/stream.mjpg?width=1280" for id in ids] if watched else []
        with viewers(url, paths, seconds) as crowd:
            share, processors = measured(url, pid, ids, seconds)
        seen = [json.loads(one.stdout.read())["fps_median"] for one in crowd]
    print(
        f"  {'watched' if watched else 'unwatched'}: {share:.1%} read, {processors:.2f} processors"
        + (f"; viewers get {np.mean(seen):.1f} a second" if seen else "")
    )


def crowd(seconds: float, views: list[str]) -> None:
    with served(*ONE) as (url, pid, ids):
        made = calibrated("sim://table?size=1920x1080", "brown-conrady")
        body = {**made.to_json(), "camera": ids[0]}
        id = asked(
            url,
            "/calibrations",
            "POST",
            {
                "camera": ids[0],
                "field": "table",
                "region": "full",
                "model": "brown-conrady",
                "image_size": [1920, 1080],
                "observations": body["observations"],
            },
        )["id"]
        activate_despite(url, id)
        until(lambda: asked(url, f"/cameras/{ids[0]}/status")["calibration_applied"])
        with viewers(
            url, [f"/cameras/{ids[0]}/stream.mjpg?view={view}&width=960" for view in views], seconds
        ) as all:
            share, processors = measured(url, pid, ids, seconds)
        seen = [json.loads(one.stdout.read())["fps_median"] for one in all]
    print(
        f"  {len(views)} viewers, {' and '.join(sorted(set(views)))}: {share:.1%} read, {processors:.2f} processors; "
        f"they get {np.mean(seen):.1f} a second"
    )


def passing() -> None:
    """One frame passed on, against decoding and encoding it."""
    from tests.support.live_cameras import FIELDS
    from touchline.images import encode, read_in_process
    from touchline.live.messages import StreamSpec
    from touchline.live.picture import passed_on
    from touchline.sources import SourceContext, source_from_url

    cv2.setNumThreads(1)
    source = source_from_url("sim://table?size=1920x1080&fps=240&robots=6", SourceContext(FIELDS))
    jpeg = cv2.imencode(".jpg", source.read().pixels, [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()
    spec, times = (
        StreamSpec("raw", 0, 80),
        {"passed on": [], "decoded and encoded": [], "at half its size": []},
    )
    for _ in range(60):
        begun = time.process_time()
        assert passed_on(read_in_process(jpeg), spec) == jpeg
        passed = time.process_time()
        encode(read_in_process(jpeg).pixels, "jpg", 80)
        whole = time.process_time()
        encode(read_in_process(jpeg).reduced(960), "jpg", 80)
        for name, took in zip(
            times, (passed - begun, whole - passed, time.process_time() - whole), strict=True
        ):
            times[name].append(1e3 * took)
    print(
        "  1920 × 1080: "
        + ", ".join(f"{name} {np.median(took):.2f} ms" for name, took in times.items())
    )


CASES = {
    "unwatched": lambda s: eight(s, False),
    "watched": lambda s: eight(s, True),
    "raw": lambda s: crowd(s, ["raw"] * 8),
    "corrected": lambda s: crowd(s, ["raw", "corrected"] * 4),
    "side": lambda s: crowd(s, ["side"] * 8),
    "passing": lambda _: passing(),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("cases", nargs="*", default=list(CASES))
    given = parser.parse_args()
    for name in given.cases:
        print(name, flush=True)
        CASES[name](given.seconds)
