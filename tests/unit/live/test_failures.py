"""One picture like no other ends none of a camera's threads: it is counted and told, and the next one is taken."""

import logging
import sys
import threading
from contextlib import contextmanager, suppress

import cv2
import pytest

from tests.support.live_cameras import SIM, calibrated, capturing, spec
from tests.support.waiting import LONG_S, until
from touchline.detection import live as detection
from touchline.detection.live import FrameBuffer, StageRenderer
from touchline.detection.records import Detections
from touchline.detection.stages import FrameResult
from touchline.drift import live as drift
from touchline.drift.live import DriftPart
from touchline.images import ImageLimits
from touchline.live import picture, worker_main
from touchline.live.camera import LiveCamera
from touchline.live.camera_part import PartContext
from touchline.live.failures import Failures, failure_words
from touchline.live.messages import StreamSpec
from touchline.live.picture import AppliedCalibration, Encoder
from touchline.live.worker_main import QualityMonitor


def fails_once(real, error):
    """The function, but for its first call."""
    calls = []

    def one(*given, **more):
        calls.append(1)
        if len(calls) == 1:
            raise error
        return real(*given, **more)

    return one


@contextmanager
def one_failure(monkeypatch):
    """A camera, its failures, and what runs a part on a thread of its own; in the end there has been one failure."""
    failures, threads = Failures(), []

    def running(part):
        def run():
            with suppress(SystemExit):
                part.run()

        threads.append(threading.Thread(target=run, daemon=True))
        threads[-1].start()
        return part

    with capturing(SIM) as capture:
        yield capture, failures, running
        monkeypatch.setattr(capture, "after", lambda *_, **__: sys.exit())  # which ends a part
        for thread in threads:
            thread.join(LONG_S)
            assert not thread.is_alive()
    assert failures.to_json()["count"] == 1
    [word] = failure_words(failures.to_json())
    assert word["severity"] == "warning" and word["text"].endswith("rror.") and word["fix"]


@pytest.mark.parametrize("error", [cv2.error("odd"), MemoryError()], ids=["OpenCV", "memory"])
def test_a_picture_that_cannot_be_drawn_is_followed_by_the_next_one(monkeypatch, error):
    monkeypatch.setattr(picture, "render", fails_once(picture.render, error))
    sent = []
    with one_failure(monkeypatch) as (capture, failures, running):
        drawing = running(
            Encoder(capture, lambda kind, number, body: sent.append(number), failures)
        )
        drawing.watch({1: (StreamSpec("raw"), 0.0)})
        until(lambda: len(sent) > 2)
        drawing.watch({2: (StreamSpec("raw"), 0.01)})
        until(lambda: 2 in sent)
        until(lambda: list(drawing._rates) == [2])  # what was watched before is forgotten


@pytest.mark.parametrize("error", [cv2.error("odd"), MemoryError()], ids=["OpenCV", "memory"])
def test_a_picture_that_cannot_be_judged_is_followed_by_the_next_one(monkeypatch, error):
    monkeypatch.setattr(
        worker_main.light, "measure_light", fails_once(worker_main.light.measure_light, error)
    )
    with one_failure(monkeypatch) as (capture, failures, running):
        judging = running(
            QualityMonitor(capture, Encoder(capture, lambda *_: None, failures), failures)
        )
        until(lambda: judging.newest is not None)


def test_a_picture_that_cannot_be_recorded_is_followed_by_the_next_one(monkeypatch):
    monkeypatch.setattr(detection.cv2, "imencode", fails_once(cv2.imencode, cv2.error("odd")))
    with one_failure(monkeypatch) as (capture, failures, running):
        buffer = running(FrameBuffer(capture, failures))
        told, pictures = buffer.clip(0.2)
        buffer.keep(True)  # it asks for the next frame, and so ends
    assert told["frames"] and pictures.startswith(b"\xff\xd8")


class Ending(dict):
    """Streams that end who draws them, on its own thread."""

    def items(self):
        sys.exit()


def test_a_stage_that_cannot_be_drawn_is_followed_by_the_next_one(monkeypatch):
    monkeypatch.setattr(
        detection, "scaled_down", fails_once(detection.scaled_down, cv2.error("odd"))
    )
    sent = []
    with one_failure(monkeypatch) as (capture, failures, running):
        drawing = running(StageRenderer(lambda number, body: sent.append(number), failures))
        taken = capture.next(0, LONG_S)
        seen = FrameResult(
            Detections((), taken.frame.size), pictures={"colours": taken.frame.pixels}
        )
        for _ in range(2):
            until(lambda: drawing._work is None)
            drawing.offer(taken, seen, {7: StreamSpec("stage-colours")}, None)
        until(lambda: sent == [7] and drawing._work is None)
        drawing.offer(taken, seen, Ending(), None)


def test_a_look_for_drift_that_fails_is_followed_by_another(monkeypatch):
    monkeypatch.setattr(drift, "DriftWatch", fails_once(drift.DriftWatch, MemoryError()))
    monkeypatch.setattr(drift, "RETRY_S", 0.1)
    with one_failure(monkeypatch) as (capture, failures, running):
        context = PartContext(
            capture, lambda _: None, lambda _number, _body: None, failures, ImageLimits()
        )
        watching = running(DriftPart(context))
        watching.apply(AppliedCalibration.of(calibrated(SIM, "brown-conrady")), None)
        until(lambda: watching.newest is not None)


def test_a_failure_that_is_over_is_said_no_more_and_none_is_none():
    failures = Failures()
    assert failure_words(failures.to_json()) == failure_words(None) == []
    assert (
        failure_words({"count": 3, "newest": {"what": "x", "error": "y", "is_recent": False}}) == []
    )


def test_the_log_tells_of_failures_at_once_and_then_ever_more_seldom(caplog):
    camera = LiveCamera("north", spec(SIM))
    newest = {"what": "A picture could not be encoded", "error": "MemoryError", "is_recent": True}
    with caplog.at_level(logging.WARNING, "touchline"):
        for count in (0, *range(1, 100), 0, 1):  # the last two are another process's
            camera._log_failures({"count": count, "newest": newest if count else None})
    assert [record.args[-1] for record in caplog.records] == [1, 2, 4, 8, 16, 32, 64, 1]
