"""Seeing live, 1080p, a simulated match of 16 robots and a ball on Division B. Prints figures, asserts none.

python tests/bench/bench_seeing_live.py core 30      60 fps in a process bound to one core: the seeing thread, its
                                                     messages and the league's packets, from rendered frames
python tests/bench/bench_seeing_live.py viewers 30   30 fps from an MJPEG camera through a real server, beside 0 and
                                                     8 viewers at 960 px, with one who listens to detections
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.request import Request, urlopen

import cv2
import numpy as np
import websockets.sync.client

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.activation import activate_despite  # noqa: E402
from tests.support.mjpeg_camera import MjpegCamera  # noqa: E402
from tests.support.watched_field import calibration_of, colour_clicks, world  # noqa: E402
from touchline.core.records import Frame  # noqa: E402
from touchline.detection.colours import learn_profile  # noqa: E402
from touchline.detection.live import LiveDetector  # noqa: E402
from touchline.detection.store import named_plan  # noqa: E402
from touchline.formats import FORMATS  # noqa: E402
from touchline.images import ImageLimits  # noqa: E402
from touchline.live.camera_part import PartContext  # noqa: E402
from touchline.live.capture import FrameCapture  # noqa: E402
from touchline.live.failures import Failures  # noqa: E402
from touchline.live.picture import AppliedCalibration  # noqa: E402
from touchline.processes.framing import decode_body  # noqa: E402
from touchline.sources import SourceContext  # noqa: E402

FPS = 60.0
REEL = 30  # rendered frames, shown to and fro


def reel():
    match = world(drift=0.0)
    there = [match.frame_at(n, n / FPS) for n in range(REEL)]
    profile = learn_profile("bench", [(there[0], colour_clicks(match))]).to_json()
    return match, there + there[::-1], profile


class Reel(FrameCapture):
    """Frames from memory, on time."""

    def __init__(self, frames) -> None:
        super().__init__("", SourceContext({}))
        self._frames = frames

    def run(self) -> None:
        begun, number = time.monotonic(), 0
        while True:
            time.sleep(max(0.0, begun + number / FPS - time.monotonic()))
            self._keep(Frame(self._frames[number % len(self._frames)]))
            number += 1


def core(seconds: float) -> None:
    cv2.setNumThreads(1)
    match, frames, profile = reel()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    heard: list[bytes] = []
    capture = Reel(frames)
    seeing = LiveDetector(
        PartContext(capture, heard.append, lambda number, body: None, Failures(), ImageLimits())
    )
    seeing.apply(AppliedCalibration.of(calibration_of(match)))
    seeing.follow(
        {
            "on": True,
            "run": True,
            "plan": named_plan("ssl").to_json(),
            "profile": profile,
            "publish": True,
            "camera_number": 0,
            "extent_mm": 1.0,
            "team_z_mm": {},
        }
    )
    threading.Thread(target=capture.run, daemon=True).start()
    threading.Thread(target=seeing.run, daemon=True).start()
    time.sleep(3)
    first, cpu, began, sent = (
        len(heard),
        time.process_time(),
        time.monotonic(),
        capture.status()["seq"],
    )
    time.sleep(seconds)
    took, spent = time.monotonic() - began, time.process_time() - cpu
    told, sent = [decode_body(body)[0] for body in heard[first:]], capture.status()["seq"] - sent
    stages = {
        one["name"]: np.median([t["stages"][i]["ms"] for t in told])
        for i, one in enumerate(told[0]["stages"])
    }
    whole = np.array([t["ms"] for t in told])
    print(
        f"{len(told) / took:.1f} of {sent / took:.1f} frames/s looked at, {100 * spent / took:.0f} % of the core, "
        f"{np.median([len(t['items']) for t in told]):g} things a frame, load {os.getloadavg()[0]:.1f}"
    )
    print(
        f"ms of processor a frame: stages median {np.median(whole):.2f}, p95 {np.percentile(whole, 95):.2f}; "
        f"everything {1000 * spent / len(told):.2f}"
    )
    print(", ".join(f"{name} {ms:.2f}" for name, ms in stages.items()))


def viewers(seconds: float) -> None:
    match, frames, profile = reel()
    jpegs = [
        cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes()
        for frame in frames[::2]
    ]
    camera = MjpegCamera(30.0)
    camera.parts = lambda n: [jpegs[n % len(jpegs)]]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "settings.yaml").write_text(
            "server: {port: 0, max_connections: 300}\nsources: {allowed_hosts: [127.0.0.1]}\ncameras:\n"
            f"- {{id: north, source: '{camera.url}', field: ssl-div-b, region: full}}\n"
        )
        server = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "from touchline.cli import main; main()",
                "serve",
                "--config",
                f"{folder}/settings.yaml",
                "--data",
                f"{folder}/data",
            ],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            port = int(server.stdout.readline().split()[-1].rstrip("/").rpartition(":")[2])
            prepared(port, match, profile)
            for count in (0, 8):
                measured(port, server.pid, count, seconds)
        finally:
            server.terminate()
            server.wait(20)
            camera.close()


def asked(
    port: int, path: str, body: bytes | None = None, method: str | None = None, **headers: str
):
    headers = {
        "content-type": "application/json",
        **{name.replace("_", "-"): one for name, one in headers.items()},
    }
    with urlopen(
        Request(f"http://127.0.0.1:{port}/api/v1{path}", body, headers, method=method), timeout=60
    ) as answer:
        return json.load(answer)


def prepared(port: int, match, profile) -> None:
    """The camera is calibrated and has its colours."""
    form = b"".join(
        b'--form\r\ncontent-disposition: form-data; name="%s"%s\r\n\r\n%s\r\n' % one
        for one in (
            (b"camera", b"", b"north"),
            (b"file", b'; filename="c.json"', FORMATS["json"].write(calibration_of(match))),
        )
    )
    made = asked(
        port,
        "/calibrations/import",
        form + b"--form--\r\n",
        content_type="multipart/form-data; boundary=form",
    )
    activate_despite(f"http://127.0.0.1:{port}", made["id"])
    body = {"on": True, "plan": "ssl", "profile": profile}
    asked(port, "/cameras/north/seeing", json.dumps(body).encode(), "PUT", if_match="unset")
    asked(port, "/cameras/north/detections")


def cpu_s(pid: int) -> float:
    """Of the camera's process: the server's child that has worked most."""
    children = [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text().split()
    ]
    spent = [
        sum(map(int, Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()[11:13]))
        for child in children
    ]
    return max(spent) / os.sysconf("SC_CLK_TCK")


def measured(port: int, server: int, count: int, seconds: float) -> None:
    crowd = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "tests.support.live_viewers",
            "127.0.0.1",
            str(port),
            "/api/v1/cameras/north/stream.mjpg?width=960",
            str(count),
            "0",
            str(seconds + 4),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    told, spent, began = [], cpu_s(server), time.monotonic()
    with websockets.sync.client.connect(
        f"ws://127.0.0.1:{port}/api/v1/cameras/north/detections"
    ) as line:
        end = time.monotonic() + seconds + 2
        while time.monotonic() < end:
            told.append(json.loads(line.recv(20)))
    used = 100 * (cpu_s(server) - spent) / (time.monotonic() - began)
    watched = json.loads(crowd.communicate(timeout=60)[0])
    late = told[len(told) // 4 :]
    frames = (late[-1]["seq"] - late[0]["seq"]) / (late[-1]["time_s"] - late[0]["time_s"])
    print(
        f"beside {count} viewers: {np.median([t['fps'] for t in late]):.1f} of {frames:.1f} frames/s looked at, "
        f"{np.median([t['ms'] for t in late]):.1f} ms each, {np.median([len(t['items']) for t in late]):g} things; a "
        f"viewer gets {watched['fps_median']:.1f} (least {watched['fps_least']:.1f}); "
        f"its process used {used:.0f} % of a core; load {os.getloadavg()[0]:.1f}"
    )


if __name__ == "__main__":
    {"core": core, "viewers": viewers}[sys.argv[1]](float(sys.argv[2]))
    os._exit(0)  # the threads of what was measured go on
