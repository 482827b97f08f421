"""`touchline demo`, the first command of the README: it starts, says where, and has cameras to calibrate."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import requests

from tests.support.waiting import LONG_S, until
from touchline import main
from touchline.cli.server import DEMO_CAMERAS


def test_the_demo_serves_its_cameras(touchline, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(main, "serve", lambda settings, **more: asked.append(settings))
    assert touchline("demo", "--data", tmp_path / "data")[0] == 0
    (settings,) = asked
    assert settings.data == tmp_path / "data"
    assert [(camera.id, camera.source) for camera in settings.cameras] == [
        (camera["id"], camera["source"]) for camera in DEMO_CAMERAS
    ]


@pytest.mark.long
def test_the_demo_starts_says_where_and_shows_its_cameras(tmp_path):
    touchline = Path(sys.executable).parent / "touchline"
    server = subprocess.Popen(
        [str(touchline), "demo", "--port", "0", "--data", str(tmp_path / "data")],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        url = re.search(r"http://127\.0\.0\.1:\d+", server.stdout.readline())[0]
        cameras = requests.get(f"{url}/api/v1/cameras", timeout=LONG_S).json()["items"]
        assert [(camera["id"], camera["source"]) for camera in cameras] == [
            (camera["id"], camera["source"]) for camera in DEMO_CAMERAS
        ]
        frame = until(
            lambda: requests.get(
                f"{url}/api/v1/cameras/{DEMO_CAMERAS[0]['id']}/frame.jpg", timeout=LONG_S
            ),
            # until then its process is starting
            lambda answer: answer.status_code != 503,
        )
        assert frame.status_code == 200 and frame.content.startswith(b"\xff\xd8")
    finally:
        server.terminate()
        server.wait(timeout=LONG_S)
