"""A camera that makes its pictures itself rests while nobody needs them, says so, and wakes for whoever comes."""

import time

import pytest

from app.core.registry import Registry
from app.live import capture as module
from app.live.capture import REST_S
from app.sources import SOURCES
from tests.support.live_cameras import SIM, capturing
from tests.support.waiting import until

PERIOD_S = 1 / 25  # of SIM


@pytest.fixture
def capture(monkeypatch):
    monkeypatch.setattr(module, "RESTS_AFTER_S", 0.3)
    with capturing(SIM) as capture:
        yield capture


def rest(capture) -> None:
    until(lambda: capture.resting and capture.status()["seq"] > 0)


def test_nobody_watches_and_one_picture_a_second_is_made(capture):
    rest(capture)
    before, begun = capture.status()["seq"], time.monotonic()
    until(lambda: capture.status()["seq"] >= before + 2)  # the first of them may come at once
    now = capture.status()
    assert time.monotonic() - begun > 0.8 * REST_S  # at its own rate 0.08 s
    assert now["state"] == "live"
    assert now["interval_s"] >= REST_S  # told as it is


def test_who_watches_gets_every_picture(capture):
    rest(capture)
    capture.watch(True)
    until(lambda: 0 < capture.status()["interval_s"] < REST_S / 2)
    assert not capture.resting
    capture.watch(False)
    rest(capture)


def test_who_asks_for_a_picture_gets_a_new_one_at_once(capture):
    rest(capture)
    taken = capture.after(capture.status()["seq"], 30)
    assert taken is not None
    assert not capture.resting


def test_a_look_in_passing_wakes_nobody(capture):
    rest(capture)
    assert capture.after(capture.status()["seq"], 30, in_passing=True) is not None
    assert capture.resting


def test_a_setting_is_done_at_once(capture):
    rest(capture)
    assert capture.set_control("exposure", 2000.0, 30).value == pytest.approx(2000, rel=0.2)


def test_only_pictures_that_are_our_own_work_may_wait():
    assert isinstance(SOURCES, Registry)
    assert [name for name in SOURCES if getattr(SOURCES[name], "CAN_REST", False)] == ["sim"]
