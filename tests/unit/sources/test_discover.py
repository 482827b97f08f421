"""What is plugged in: found with its address and identity, whatever becomes of one of those who look."""

import os
import signal
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.industrial import GvCamera, opened
from tests.support.peers import V4l2Source
from tests.support.plugged_cameras import plug_in
from tests.support.waiting import until
from touchline.processes.start import ChildProcess, Program, start
from touchline.sources.discover import _short_names, answer_of, discover_cameras

LONG_S = 60.0  # on a busy machine Python alone may take long to start


@pytest.fixture(autouse=True)
def no_webcams(tmp_path, monkeypatch):
    monkeypatch.setattr(V4l2Source, "root", tmp_path / "machine")
    return tmp_path / "machine"


def test_a_camera_on_the_network_is_found_and_opens_by_what_is_told():
    with closing(GvCamera()):
        cameras = [one for one in discover_cameras(LONG_S) if GvCamera.SERIAL in one["address"]]
        assert [one["title"] for one in cameras] == [
            f"Aravis Fake {GvCamera.SERIAL}, through Aravis"
        ]
        with closing(opened(cameras[0]["address"])) as camera:
            assert vars(camera.identity()) == cameras[0]["identity"]


def test_a_webcam_is_found(no_webcams):
    plug_in(no_webcams, 0)
    webcams = [one for one in discover_cameras(LONG_S) if one["address"].startswith("v4l2:")]
    assert len(webcams) == 1 and webcams[0]["identity"]["address"] == webcams[0]["address"]
    assert "/dev/video0" in webcams[0]["title"]


def looker(word: str) -> int:
    """The process that looks through that library, as soon as it runs."""

    def found():
        for task in Path("/proc/self/task").iterdir():
            for pid in (task / "children").read_text().split():
                line = Path(f"/proc/{pid}/cmdline")
                if line.exists() and f":{word}_cameras".encode() in line.read_bytes():
                    return int(pid)

    return until(found)


def found_while(deed, deadline_s: float) -> list:
    """What is found while something befalls those who look."""
    answer = []
    looking = threading.Thread(target=lambda: answer.extend(discover_cameras(deadline_s)))
    looking.start()
    deed()
    looking.join(LONG_S)
    assert not looking.is_alive()
    return answer


def test_one_that_dies_takes_nothing_from_the_others(no_webcams):
    plug_in(no_webcams, 0)
    cameras = found_while(lambda: os.kill(looker("aravis"), signal.SIGKILL), LONG_S)
    assert [one["address"].partition(":")[0] for one in cameras] == ["v4l2"]


def test_one_that_dies_before_it_is_told_anything_takes_nothing_from_the_others(
    monkeypatch, no_webcams
):
    plug_in(no_webcams, 0)

    def started_and_dead(program):
        process, line = start(program)
        if "aravis" in program.main:
            process.kill()
            process.wait()
        return process, line

    monkeypatch.setattr("touchline.processes.start.start", started_and_dead)
    cameras = discover_cameras(LONG_S)
    assert [one["address"].partition(":")[0] for one in cameras] == ["v4l2"]


def test_one_that_hangs_is_left_out_at_the_deadline_and_ended():
    stopped = []

    def stop():
        stopped.append(looker("aravis"))
        os.kill(stopped[0], signal.SIGSTOP)

    start = time.monotonic()
    cameras = found_while(stop, 2.0)
    assert time.monotonic() - start < LONG_S and not any(
        one["address"].startswith("aravis:") for one in cameras
    )
    assert not Path(f"/proc/{stopped[0]}").exists()


def test_what_a_makers_library_prints_does_not_get_into_the_answer():
    finder = ChildProcess(Program("tests.support.loud_finder:main"), {})
    assert answer_of(finder, time.monotonic() + LONG_S) == [{"address": "loud://0"}]


def test_where_nothing_is_plugged_in_nothing_is_found():
    assert [
        one
        for one in discover_cameras(LONG_S)
        # there may be real ones on this network
        if not one["address"].startswith("aravis:")
    ] == []


def test_a_serial_number_names_a_camera_only_if_it_is_its_own():
    assert _short_names([("7", "a"), ("8", "b"), ("7", "c"), ("", "d")]) == ["a", "8", "c", "d"]
