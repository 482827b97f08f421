"""Industrial cameras for tests: the simulated ones of Aravis, and a real GigE Vision one on this machine.

What is not installed is said and left out; where TOUCHLINE_TESTS is "all" (.ci/run sets it), it fails instead.
"""

import ctypes
import fcntl
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import NoReturn

import pytest

from touchline.core.errors import TouchlineError, Unavailable
from touchline.sources import SourceContext, source_from_url
from touchline.sources.industrial import aravis as aravis_source
from touchline.sources.industrial.aravis_library import aravis

GV_CAMERA = "arv-fake-gv-camera-0.8"


def missing(what: str, fix: str) -> NoReturn:
    """Skip the test that needs it, or fail where nothing may be left out."""
    text = f"{what} is not installed; {fix}"
    if os.environ.get("TOUCHLINE_TESTS") == "all":
        pytest.fail(text)
    pytest.skip(text)


def need_aravis() -> None:
    try:
        aravis()
    except Unavailable as gone:
        missing("libaravis-0.8", gone.fix)


def opened(url: str, patience_s: float = 20.0):
    """The camera, as soon as whoever had it before lets go of it: a camera notices that only after some seconds."""
    until = time.monotonic() + patience_s
    while True:
        try:
            return source_from_url(url, SourceContext())
        except TouchlineError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)


class GvCamera:
    """Starts one that listens on 127.0.0.1, as soon as nobody else's does: their port is fixed."""

    SERIAL = "TL01"

    def __init__(self, *options: str) -> None:
        need_aravis()
        if not shutil.which(GV_CAMERA):
            missing(GV_CAMERA, "apt install aravis-tools")
        self._lock = open(Path(tempfile.gettempdir()) / "touchline-gv-camera.lock", "w")  # noqa: SIM115
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        self._options = options
        self.start()

    def start(self) -> None:
        _wait_for_port()
        self._process = subprocess.Popen(
            [GV_CAMERA, "-i", "127.0.0.1", "-s", self.SERIAL, *self._options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=_end_with_us,
        )
        with closing(opened("aravis://127.0.0.1?fps=200")) as camera:
            # it sends a picture at one go: small ones fit into any socket's buffer
            for side in ("width", "height"):
                camera.set_control(side, 256)
            # It numbers its pictures from 65400, and a client that comes just before 65535 takes all for late ones up
            # to there; so past that before the test begins.
            came = 0
            while came < 150:
                with suppress(Unavailable):
                    camera.read()
                    came += 1
            camera.set_control("frame_rate", 25)

    def stop(self) -> None:
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        self.stop()
        self._lock.close()


def _wait_for_port(patience_s: float = 60.0) -> None:
    """Two of them would both start and share what comes in, packet by packet."""
    until = time.monotonic() + patience_s
    while True:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            try:
                return line.bind(("127.0.0.1", aravis_source.PORT))
            except OSError:
                assert time.monotonic() < until, (
                    f"another camera listens on 127.0.0.1:{aravis_source.PORT} already"
                )
        time.sleep(0.2)


def _end_with_us() -> None:
    """In the child, before it becomes the camera: even a test run that is killed leaves none behind."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def held() -> dict[str, int]:
    """What this process holds of the machine: open files and threads."""
    return {
        "files": len(os.listdir("/proc/self/fd")),
        "threads": len(os.listdir("/proc/self/task")),
    }
