"""A simulated camera can be knocked and defocused while it runs, as people do to real ones."""

import time

import numpy as np
import pytest

from tests.support.live_cameras import FIELDS
from touchline.core.errors import BadInput
from touchline.sources import SourceContext, source_from_url

URL = "sim://table?size=320x256&fps=200&robots=0&noise=0"


def opened():
    return source_from_url(URL, SourceContext(FIELDS))


def bumped(source, **settings):
    """Set, and painted anew."""
    for name, value in settings.items():
        assert source.set_control(name, value).value == value
    end = time.monotonic() + 60
    while not source.settled:
        assert time.monotonic() < end, "it was never painted"
        source.read()
    return source


def test_a_knock_moves_the_middle_of_the_picture_by_that_much():
    source = opened()
    before, still = source.camera.raw_from_field(np.zeros(2)), source.read().pixels
    bumped(source, knock=4.0)
    after, moved = source.camera.raw_from_field(np.zeros(2)), source.read().pixels
    assert abs(after[0] - before[0]) == pytest.approx(4.0, abs=0.1)
    assert np.abs(moved.astype(int) - still).max() > 60
    assert source.camera.position_mm == opened().camera.position_mm


def test_put_back_it_sees_what_it_saw():
    source = opened()
    still = source.read().pixels
    bumped(source, knock=-7.0)
    bumped(source, knock=0.0)
    assert np.array_equal(source.read().pixels, still)


def test_out_of_focus_lines_are_softer():
    source = opened()
    sharp = np.abs(np.diff(source.read().pixels.astype(int), axis=1)).max()
    bumped(source, softer=2.0)
    assert np.abs(np.diff(source.read().pixels.astype(int), axis=1)).max() < 0.7 * sharp


def test_a_knocked_camera_keeps_its_resolution():
    source = opened()
    source.set_control("resolution", "160x128")
    bumped(source, knock=4.0)
    assert source.read().pixels.shape == (128, 160, 3)


@pytest.mark.parametrize(
    ("name", "value"), [("knock", 1e9), ("knock", "far"), ("softer", -1), ("softer", float("nan"))]
)
def test_what_no_camera_can_suffer_is_refused(name, value):
    source = opened()
    with pytest.raises(BadInput):
        source.set_control(name, value)
    assert {c.name: c.value for c in source.controls()}[name] == 0
