"""Frames that come damaged, or come no more: whoever follows a camera goes on with the next whole one."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count, pairwise

import numpy as np
import pytest

from app.core.errors import Unavailable
from app.core.records import Frame
from app.images import ImageLimits, read_in_process
from app.live import drift, rolls
from app.live.capture import FrameCapture
from app.live.drift import CameraDriftMonitor
from app.live.failures import Failures
from app.live.rolls import RollMonitor
from app.sources import SourceContext
from tests.support.pictures import encoded, gradient
from tests.support.waiting import LONG_S


@pytest.fixture
def capture():
    """Of no source: the test gives the frames."""
    return FrameCapture("", SourceContext())


def test_the_last_frame_of_a_stopped_stream_is_learnt_from_once(capture, monkeypatch):
    monkeypatch.setattr(drift, "WAIT_S", 0.01)
    monkeypatch.setattr(drift, "LEARN_S", 0.01)
    monkeypatch.setattr(drift, "_reference", lambda pictures, _: [int(pixels[0, 0, 0]) for pixels in pictures])
    monitor = CameraDriftMonitor(capture, ImageLimits(), Failures())
    with ThreadPoolExecutor() as pool:
        learnt = pool.submit(monitor._learnt, None)
        for number in count(1):
            capture._keep(Frame(np.full((4, 4, 3), number, np.uint8)))
            time.sleep(0.1)  # no frame comes for longer than is waited
            if learnt.done():
                break
    assert all(sooner < later for sooner, later in pairwise(learnt.result(LONG_S)))


def test_rolls_are_followed_on_after_a_damaged_frame(capture, monkeypatch):
    monkeypatch.setattr(rolls, "WAIT_S", 0.3)
    whole = encoded("jpg", gradient(640, 480))
    damaged = bytearray(whole)
    damaged[damaged.index(b"\xff\xdb") + 4] = 0x0F  # a table that no picture has
    monitor = RollMonitor(capture)
    capture._keep(read_in_process(whole))
    watch = monitor.poll("", 0, 0)["watch"]
    capture._keep(read_in_process(bytes(damaged)))
    with pytest.raises(Unavailable):
        monitor.poll(watch, 0, 1)
    capture._keep(read_in_process(whole))
    assert monitor.poll(watch, 0, 1)["seq"] == 3
