"""An agreement of cameras is void once one has moved, and dated where nobody watched or much time has passed."""

from datetime import UTC, datetime, timedelta

import pytest

from touchline.drift.alarm import DriftWatch
from touchline.evaluate.field_lines.motion import MotionSample
from touchline.fitting.image_motion import MotionSize
from touchline.rigs.service import as_of_now

AT = datetime(2026, 11, 28, 9, tzinfo=UTC)
GOOD = {
    "at": "2026-11-28T09:00:00.000Z",
    "p95_mm": 2.0,
    "pairs": [{"a": "north", "b": "south", "level": "good", "median_mm": 0.6, "max_mm": 1.8}],
    "verdict": {"level": "good", "reason": None, "sentence": "The cameras agree.", "fix": ""},
}
TITLES = {"north": "North", "south": "South"}


def drift(*samples):
    watch = DriftWatch(0.0)
    for sample in samples:
        watch.add(sample, 1.0)
    return {"drift": watch.status.to_json()}


def seen(px=0.0):
    return MotionSample("seen", 90, MotionSize(px, 5 * px, 0.01, 0.05), None, 100 * px)


STEADY = drift(seen(), seen())


def judged(south, hours=1.0):
    return as_of_now(GOOD, TITLES, {"north": STEADY, "south": south}, AT + timedelta(hours=hours))


def test_a_check_of_cameras_that_stand_where_they_stood_holds():
    assert judged(STEADY) == {**GOOD, "outdated": []}


@pytest.mark.parametrize(
    ("samples", "reason"),
    [
        ([seen(3)] * 2, "moved"),
        ([MotionSample("gone", 0)] * 4, "moved"),
        ([seen(3)] * 2 + [MotionSample("dark", 0)] * 5, "moved"),
        ([MotionSample("soft", 90, MotionSize(0, 0, 0, 0), softer_px=2.0)] * 2, "out-of-focus"),
    ],
)
def test_a_camera_with_an_alarm_makes_it_void(samples, reason):
    found = judged(drift(*samples))
    (outdated,) = found["outdated"]
    assert (outdated["camera"], outdated["reason"]) == ("south", reason)
    assert outdated["text"].startswith("South:") and "check the rig again" in outdated["fix"]
    assert found["verdict"]["level"] is None and found["verdict"]["reason"] == "outdated"
    assert found["pairs"] == []
    assert "no longer valid" in found["verdict"]["sentence"] and found["verdict"]["fix"]
    assert found["verdict"]["statements"]["sentence"][0]["code"] == "rig.void"


@pytest.mark.parametrize(
    "status", [{"drift": None}, drift(), drift(*[MotionSample("covered", 0)] * 5)]
)
def test_a_camera_that_nobody_watches_dates_it(status):
    found = judged(status)
    assert [(one["camera"], one["reason"]) for one in found["outdated"]] == [
        ("south", "not-monitored")
    ]
    assert found["verdict"]["level"] == "good"


def test_an_old_check_is_dated_and_what_voids_it_comes_first():
    (old,) = judged(STEADY, hours=30)["outdated"]
    assert (old["camera"], old["reason"]) == (None, "old") and "30 hours" in old["text"]
    both = as_of_now(
        GOOD, TITLES, {"north": {"drift": None}, "south": drift(seen(3), seen(3))}, AT
    )["outdated"]
    assert [one["reason"] for one in both] == ["moved", "not-monitored"]
