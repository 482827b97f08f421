"""The last seconds of a camera's picture: as long as asked for, of one size, within the limit."""

import threading
from contextlib import suppress

import numpy as np
import pytest

from tests.support.waiting import LONG_S
from touchline.core.errors import Unavailable
from touchline.core.records import Frame
from touchline.detection import live
from touchline.detection.live import FrameBuffer
from touchline.live.capture import CapturedFrame
from touchline.live.failures import Failures


def recording(buffer) -> threading.Thread:
    """Its thread, begun; a capture's SystemExit ends it."""

    def record():
        with suppress(SystemExit):
            buffer.run()

    thread = threading.Thread(target=record, daemon=True)
    thread.start()
    return thread


def test_a_clip_that_could_not_be_had_records_nothing_more(monkeypatch):
    asked = []

    class Silent:
        def after(self, seq, timeout_s):
            asked.append(seq)
            raise SystemExit  # only so does the thread end

    monkeypatch.setattr(live, "SILENT_S", 0.1)
    monkeypatch.setattr(live, "IDLE_S", 0.05)
    buffer = FrameBuffer(Silent(), Failures())
    with pytest.raises(Unavailable):
        buffer.clip(1.0)
    thread = recording(buffer)
    thread.join(0.3)  # in which it would have asked
    assert not asked
    buffer.keep(True)
    thread.join(LONG_S)
    assert asked


def test_a_picture_whose_size_keeps_changing_is_recorded_up_to_the_limit(monkeypatch):
    class Turned:
        """Ten frames upright, ten across, and so on: sixty."""

        def after(self, seq, timeout_s):
            if seq == 60:
                raise SystemExit
            across = seq // 10 % 2
            pixels = np.zeros((48, 64, 3) if across else (64, 48, 3), np.uint8)
            return CapturedFrame(Frame(pixels), seq + 1, seq / live.CLIP_FPS, seq / live.CLIP_FPS)

    monkeypatch.setattr(live, "MAX_CLIP_BYTES", 3000)  # four of these frames
    monkeypatch.setattr(live, "IDLE_S", 0.05)
    buffer = FrameBuffer(Turned(), Failures())
    buffer.keep(True)
    recording(buffer).join(LONG_S)
    clip, jpegs = buffer.clip(0.3)
    assert [one["seq"] for one in clip["frames"]] == [57, 58, 59, 60] and (
        clip["width"],
        clip["height"],
    ) == (64, 48)
    assert len(jpegs) == sum(one["bytes"] for one in clip["frames"]) <= 3000


@pytest.mark.parametrize("step_s", [-3600, 3600])
def test_a_clip_is_as_long_as_asked_for_while_the_clock_is_set(monkeypatch, step_s):
    class Stepped:
        """Sixty frames; the unix clock is set after the fiftieth."""

        def after(self, seq, timeout_s):
            if seq == 60:
                raise SystemExit
            moment = seq / live.CLIP_FPS
            return CapturedFrame(
                Frame(np.zeros((48, 64, 3), np.uint8)),
                seq + 1,
                moment + (seq >= 50) * step_s,
                moment,
            )

    monkeypatch.setattr(live, "IDLE_S", 0.05)
    buffer = FrameBuffer(Stepped(), Failures())
    buffer.keep(True)
    recording(buffer).join(LONG_S)
    assert [one["seq"] for one in buffer.clip(2.0)[0]["frames"]] == list(range(40, 61))
