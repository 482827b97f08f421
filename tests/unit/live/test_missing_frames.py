"""Frames that come damaged, or come no more: whoever follows a camera goes on with the next whole one."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count, pairwise
from queue import SimpleQueue
from threading import Event

import numpy as np
import pytest

from tests.support.pictures import encoded, gradient
from tests.support.waiting import LONG_S
from touchline.core.errors import Unavailable
from touchline.core.records import Frame
from touchline.detection.live import LiveDetector
from touchline.detection.store import named_plan
from touchline.drift import live as drift
from touchline.drift.live import DriftPart
from touchline.images import ImageLimits, read_in_process
from touchline.live.camera_part import PartContext
from touchline.live.capture import FrameCapture
from touchline.live.failures import Failures
from touchline.processes.framing import decode_body
from touchline.sources import SourceContext
from touchline.straight import live as rolls
from touchline.straight.live import RollMonitor


@pytest.fixture
def capture():
    """Of no source: the test gives the frames."""
    return FrameCapture("", SourceContext())


def test_the_last_frame_of_a_stopped_stream_is_learnt_from_once(capture, monkeypatch):
    monkeypatch.setattr(drift, "WAIT_S", 0.01)
    monkeypatch.setattr(drift, "LEARN_S", 0.01)
    monkeypatch.setattr(
        drift, "_reference", lambda pictures, _: [int(pixels[0, 0, 0]) for pixels in pictures]
    )
    monitor = DriftPart(
        PartContext(capture, lambda _: None, lambda _number, _body: None, Failures(), ImageLimits())
    )
    with ThreadPoolExecutor() as pool:
        learnt = pool.submit(monitor._learn, None)
        for number in count(1):
            capture._keep(Frame(np.full((4, 4, 3), number, np.uint8)))
            time.sleep(0.1)  # no frame comes for longer than is waited
            if learnt.done():
                break
    assert all(sooner < later for sooner, later in pairwise(learnt.result(LONG_S)))


@pytest.fixture
def whole():
    return encoded("jpg", gradient(640, 480))


@pytest.fixture
def damaged(whole):
    """With a quantisation table that no picture has: it passes the screening, and cannot be decoded."""
    jpeg = bytearray(whole)
    jpeg[jpeg.index(b"\xff\xdb") + 4] = 0x0F
    return bytes(jpeg)


def test_objects_are_detected_with_the_same_colours_after_a_damaged_frame(capture, whole, damaged):
    heard: SimpleQueue[dict] = SimpleQueue()
    is_gone = Event()

    def send(body: bytes) -> None:
        if is_gone.is_set():
            raise ConnectionResetError
        heard.put(decode_body(body)[0])

    detector = LiveDetector(
        PartContext(capture, send, lambda _number, _body: None, Failures(), ImageLimits())
    )
    detector._renderer.run = lambda: None  # its thread would outlive the test
    detector.follow(
        {
            "on": True,
            "run": True,
            "plan": named_plan("ssl").to_json(),
            "profile": None,
            "publish": False,
            "camera_number": 0,
            "extent_mm": 9000.0,
            "team_z_mm": {},
        }
    )
    with ThreadPoolExecutor() as pool:
        working = pool.submit(detector.run)
        seen = []
        for frame in (whole, damaged, whole):
            capture._keep(read_in_process(frame))
            told = heard.get(timeout=LONG_S)
            seen.append((told["seq"], bool(told["stages"]), detector.learned))
        is_gone.set()
        capture._keep(read_in_process(whole))
        working.result(LONG_S)
    assert [(number, is_whole) for number, is_whole, _ in seen] == [
        (1, True),
        (2, False),
        (3, True),
    ]
    assert all(learned is detector.learned is not None for _, _, learned in seen)  # learned once


def test_rolls_are_followed_on_after_a_damaged_frame(capture, whole, damaged, monkeypatch):
    monkeypatch.setattr(rolls, "WAIT_S", 0.3)
    monitor = RollMonitor(capture)
    capture._keep(read_in_process(whole))
    watch = monitor.poll("", 0, 0)["watch"]
    capture._keep(read_in_process(damaged))
    with pytest.raises(Unavailable):
        monitor.poll(watch, 0, 1)
    capture._keep(read_in_process(whole))
    assert monitor.poll(watch, 0, 1)["seq"] == 3
