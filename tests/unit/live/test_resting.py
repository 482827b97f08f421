"""A camera that makes its pictures itself makes as many as are needed, says so, and wakes for whoever comes."""

import sys
import time
from contextlib import suppress
from types import SimpleNamespace

import pytest

from tests.support.live_cameras import SIM, capturing, spec
from tests.support.waiting import LONG_S, until
from touchline.core.registry import Registry
from touchline.live import capture as module
from touchline.live import messages
from touchline.live.capture import REST_S
from touchline.live.failures import Failures
from touchline.live.messages import StreamSpec
from touchline.live.picture import Encoder
from touchline.live.worker_main import CameraWorker
from touchline.sources import SOURCES

CARD_S = 0.2  # between two pictures of a thumbnail


@pytest.fixture
def capture(monkeypatch):
    monkeypatch.setattr(module, "RESTS_AFTER_S", 0.3)
    monkeypatch.setattr(messages, "RATE_FRAMES", 2)
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
    capture.watch(0)
    until(lambda: 0 < capture.status()["interval_s"] < REST_S / 2)
    assert not capture.resting
    capture.watch(REST_S)
    rest(capture)


def test_who_leaves_and_comes_back_soon_finds_it_awake(capture, monkeypatch):
    rest(capture)
    monkeypatch.setattr(module, "RESTS_AFTER_S", 0.0)
    capture.watch(0)
    monkeypatch.setattr(module, "RESTS_AFTER_S", LONG_S)
    capture.watch(REST_S)
    assert not capture.resting


def test_who_watches_a_few_a_second_has_no_more_made(capture):
    rest(capture)
    capture.watch(CARD_S)
    taken = [capture.after(capture.status()["seq"], LONG_S, in_passing=True)]
    while len(taken) < 5:
        taken.append(capture.after(taken[-1].seq, LONG_S, in_passing=True))
    assert [one.seq - taken[0].seq for one in taken] == list(range(5))
    # begun 4 apart, and each was done a little later
    assert taken[-1].moment - taken[0].moment > 3 * CARD_S
    assert (
        until(lambda: capture.status()["interval_s"], lambda interval_s: interval_s < REST_S)
        >= CARD_S
    )


def test_who_begins_to_watch_a_few_a_second_gets_a_new_one_at_once(capture, monkeypatch):
    rest(capture)
    monkeypatch.setattr(module, "REST_S", LONG_S)
    capture.watch(LONG_S)
    # it rests for long
    until(lambda: capture.after(capture.status()["seq"], 1.5 * REST_S, in_passing=True) is None)
    capture.watch(CARD_S)
    assert capture.after(capture.status()["seq"], LONG_S / 2, in_passing=True) is not None


def test_the_rate_at_rest_is_forgotten_when_somebody_comes(capture):
    rest(capture)
    seq = capture.status()["seq"]
    until(lambda: capture.status()["seq"] >= seq + 3)
    capture.watch(CARD_S)
    assert capture.status()["interval_s"] < REST_S / 2


def test_less_than_one_a_second_is_no_less_than_at_rest(capture):
    rest(capture)
    capture.watch(10)
    until(lambda: capture.status()["interval_s"] < 5)


def test_what_it_shows_goes_on_while_none_is_made(capture):
    def shown_s() -> float:
        return capture._between_frames(lambda source: source.time_s, LONG_S)

    rest(capture)
    before = shown_s()
    rest(capture)
    seq = capture.status()["seq"]
    until(lambda: capture.status()["seq"] >= seq + 3)
    assert shown_s() - before > REST_S


def test_the_most_demanding_of_those_who_watch_sets_the_pace(capture):
    rest(capture)
    worker = CameraWorker(SimpleNamespace(send=lambda *_: None), spec(SIM))
    worker._capture = capture
    for intervals_s, least_s in (((0.6, CARD_S), CARD_S), ((CARD_S, 0), 0), ((), REST_S)):
        worker._watch(
            [
                {"number": number, "interval_s": interval_s, "spec": {}}
                for number, interval_s in enumerate(intervals_s)
            ]
        )
        until(
            lambda: capture.status()["interval_s"],
            lambda interval_s, least_s=least_s: (
                interval_s > 0 and least_s <= interval_s < least_s + 0.3
            ),
        )
        assert not intervals_s or capture.resting == (least_s > 0)


def test_drawing_pictures_has_no_more_made(capture):
    drawn = []

    def send(*picture) -> None:
        drawn.append(picture)
        if len(drawn) == 3:
            sys.exit()

    rest(capture)
    capture.watch(CARD_S)
    encoder = Encoder(capture, send, Failures())
    encoder.watch({1: (StreamSpec(), CARD_S)})
    with suppress(SystemExit):
        encoder.run()
    assert len(drawn) == 3 and capture.resting


def test_only_pictures_that_are_our_own_work_may_wait():
    assert isinstance(SOURCES, Registry)
    assert [name for name in SOURCES if getattr(SOURCES[name], "CAN_REST", False)] == ["sim"]
