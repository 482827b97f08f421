"""What an open scene costs a live stream. Command: python -m pytest tests/bench/bench_scene.py -s

A real server, a simulated camera at 30 frames a second that a viewer in a process of its own watches; by turns without
a scene and with one that is open, with live pictures, and whose viewer takes all that it sends through the server's own
port. A browser's own drawing is not in it: that is the viewer's machine. Then how long a scene takes to open, and what
its process needs.
"""

import json
import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import requests
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.scene_calibrations import border_and_circle_clicks
from tests.support.servers import served

HERE = Path(__file__).parent
TURNS, SECONDS, FPS = 5, 8.0, 30
SOURCE = (
    f"sim://ssl-div-b?cameras=2&camera=0&lens=half&tilt=6&fill=0.86&robots=0&size=640x512&fps={FPS}"
)
CAMERA_MESSAGE = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 5.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 900,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 1.0, 0.0),
}


@contextmanager
def an_open_scene(url: str, calibration: str):
    """(seconds until it was told what is shown, bytes that came so far)."""
    import msgspec

    ws, taken = url.replace("http", "ws"), [0]
    began = time.monotonic()
    with connect(f"{ws}/api/v1/scene", proxy=None) as line:
        address = json.loads(line.recv(timeout=60))["address"]
        line.send(json.dumps({"show": {"calibrations": [calibration]}}))
        line.recv(timeout=60)
        took = time.monotonic() - began
        with connect(
            f"{ws}{address.rstrip('/')}",
            subprotocols=[f"viser-v{viser.__version__}"],
            proxy=None,
            max_size=None,
            compression=None,
        ) as viewer:
            viewer.send(msgspec.msgpack.encode(CAMERA_MESSAGE))

            def take():
                try:
                    for message in viewer:
                        taken[0] += len(message)
                except ConnectionClosed:
                    return

            thread = threading.Thread(target=take)
            thread.start()
            yield took, taken
        thread.join()


def stream_fps(url: str) -> float:
    host, _, port = url.removeprefix("http://").partition(":")
    told = subprocess.run(
        [
            sys.executable,
            "-m",
            "tests.support.live_viewers",
            host,
            port,
            "/api/v1/cameras/north/stream.mjpg?width=640",
            "1",
            "0",
            str(SECONDS),
        ],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return json.loads(told)["fps_median"]


def cpu_s(pid: int) -> float:
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def test_an_open_scene_leaves_a_live_stream_its_frames(tmp_path):
    (tmp_path / "s.yaml").write_text(
        f"cameras:\n- {{id: north, source: '{SOURCE}', field: ssl-div-b}}\n"
    )
    with served(tmp_path / "data", "--config", str(tmp_path / "s.yaml")) as url:
        api = f"{url}/api/v1"
        made = requests.post(
            f"{api}/calibrations",
            json={
                "snapshot": requests.post(f"{api}/snapshots", json={"camera": "north"}).json()[
                    "id"
                ],
                "camera": "north",
                "field": "ssl-div-b",
                "region": "half-left",
                "model": "brown-conrady",
                "observations": border_and_circle_clicks(SOURCE, "half-left"),
            },
        ).json()
        stream_fps(url)  # awake
        alone, beside, opening, rates, shares = [], [], [], [], []
        for _ in range(TURNS):
            alone.append(stream_fps(url))
            with an_open_scene(url, made["id"]) as (took, taken):
                time.sleep(2)  # until it is drawn: that happens once
                [pid] = [int(p) for p in os.listdir("/proc") if p.isdigit() and _is_scene(p)]
                bytes_before, cpu_before, began = taken[0], cpu_s(pid), time.monotonic()
                beside.append(stream_fps(url))
                lasted = time.monotonic() - began
                rates.append((taken[0] - bytes_before) / lasted / 1e3)
                shares.append((cpu_s(pid) - cpu_before) / lasted)
                opening.append(took)
                memory = (
                    int(Path(f"/proc/{pid}/statm").read_text().split()[1])
                    * os.sysconf("SC_PAGESIZE")
                    / 1e6
                )
    loss = 1 - np.median(beside) / np.median(alone)
    print(
        f"\nstream alone {np.median(alone):.2f} fps ({min(alone):.2f} to {max(alone):.2f}), with an open scene "
        f"{np.median(beside):.2f} ({min(beside):.2f} to {max(beside):.2f}): {loss:.1%} slower; the scene opened in "
        f"{np.median(opening):.1f} s, takes {np.median(shares):.1%} of a core, {memory:.0f} MB, sends "
        f"{np.median(rates):.0f} kB/s; load {os.getloadavg()[0]:.1f}"
    )
    assert loss <= 0.05


def _is_scene(pid: str) -> bool:
    try:
        return "touchline.scene.live" in (Path("/proc") / pid / "cmdline").read_text()
    except OSError:
        return False
