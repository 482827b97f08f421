"""A picture that is turned by half a turn or mirrored has the same lines: what else is in it tells."""

import numpy as np
import pytest

from tests.support.drifting_cameras import fitted
from tests.support.live_cameras import FIELDS, calibrated
from tests.support.simulated_source import simulated_source
from tests.support.tiers import rounds
from touchline.core.errors import FitFailed
from touchline.core.records import Frame
from touchline.drift.alarm import DriftWatch
from touchline.drift.check import check
from touchline.drift.reregister import reregister
from touchline.evaluate.field_lines.motion import LineReference
from touchline.evaluate.field_lines.orientation import OrientationReference
from touchline.models import Restored

URL = "sim://table?size=640x480&robots=3"
WAYS = {"turned": (-1, -1), "mirrored": (1, -1), "upside down": (-1, 1)}
SCENES = (
    "sim://ssl-div-b?size=640x512&robots=12&people=2&k1=-0.2",
    "sim://ssl-div-b?cameras=2&camera=0&size=640x512&robots=12&people=3&flicker=0.1&tilt=12&k1=-0.35",
    "sim://ssl-div-a?size=640x480&robots=22&people=4&drift=0.5&flicker=0.05",
    "sim://vsss-3v3?size=640x480&robots=6&people=1&drift=0.5&noise=4",
    "sim://table?size=640x512&robots=8&people=4&noise=6&flicker=0.2&glare=0.5",
)


def turned(picture, way):
    rows, columns = WAYS[way]
    return np.ascontiguousarray(picture[::rows, ::columns])


@pytest.fixture(scope="module")
def calibration():
    return calibrated(URL, "brown-conrady")


@pytest.fixture(scope="module")
def rendering():
    return simulated_source(URL, FIELDS).rendering


@pytest.mark.parametrize("way", WAYS)
def test_lines_that_fit_in_a_turned_or_mirrored_picture_convince_nobody(
    calibration, rendering, way
):
    before, now = rendering.frame_at(0, 0.0), turned(rendering.frame_at(40, 40.0), way)
    reason = "turned" if way == "turned" else "mirrored"
    assert check(calibration, now)["orientation"] == "unknown"  # and its lines are where they were
    found = check(calibration, now, before=before)
    assert found["orientation"] == "contradicted" and found["verdict"]["level"] == "poor"
    assert found["verdict"]["reason"] == reason and found["verdict"]["fix"]
    assert reregister(calibration, Frame(now))[0]["verdict"]["level"] != "poor"
    with pytest.raises(FitFailed) as refused:
        reregister(calibration, Frame(now), before=Frame(before))
    assert refused.value.reason == reason and refused.value.fix

    reference, watch, sample = (
        LineReference.of([before], *Restored.of(calibration)),
        DriftWatch(0.0),
        None,
    )
    for second in range(5):
        sample = reference.look(now, sample)
        told = watch.add(sample, float(second)).to_json()
    assert told["state"] == "replaced" and told["alarm"] and reason in told["sentence"]


def test_the_same_way_round_is_confirmed_and_registered(calibration, rendering):
    before, now = rendering.frame_at(0, 0.0), rendering.frame_at(40, 40.0)
    found = check(calibration, now, before=before)
    assert found["orientation"] == "confirmed" and found["verdict"]["reason"] not in (
        "turned",
        "mirrored",
    )
    assert (
        reregister(calibration, Frame(now), before=Frame(before))[0]["verdict"]["level"] != "poor"
    )


@rounds("url", SCENES[0], *SCENES[1:])
def test_robots_people_and_light_turn_no_picture(url):
    rendering, model = fitted(url)
    reference = OrientationReference.of(rendering.frame_at(0, 0.0), model, rendering.region)
    for second in (3, 50, 111, 170, 240, 300, 390, 480, 555, 610):
        found = reference.compare(rendering.frame_at(second, float(second)), model)
        assert found.state != "contradicted", (second, found)


def test_where_nothing_is_asymmetric_nothing_is_claimed(calibration):
    model, _, region = Restored.of(calibration)
    even = np.full((480, 640, 3), 90, np.uint8)
    assert OrientationReference.of(even, model, region).compare(even, model).state == "unknown"
