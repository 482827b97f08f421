"""Dark lines on light ground are found, checked and followed as bright ones on dark ground are."""

import numpy as np
import pytest

from tests.support.auto_scenes import SceneSpec, error_mm, scene_of
from touchline.automatic.request import AutomaticRequest
from touchline.core import opencv
from touchline.core.records import Frame
from touchline.drift.check import check
from touchline.drift.reregister import reregister
from touchline.evaluate.field_lines.motion import LineReference
from touchline.models import Restored
from touchline.vision.ridges import painted_lines, with_bright_lines

SPEC = SceneSpec(
    3, "vsss-3v3", "full", "mild", (640, 480), 2200.0, 8.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)


@pytest.fixture(scope="module")
def scene():
    return scene_of(SPEC)


@pytest.fixture(scope="module")
def dark(scene):
    """The same hall with black lines on a white carpet."""
    return np.asarray(255 - scene.pixels, np.uint8)


@pytest.fixture(scope="module")
def made(scene, dark):
    told, calibration = AutomaticRequest(scene.field, scene.region).answer(Frame(dark))
    assert calibration is not None, told["verdict"]
    return calibration


def test_dark_lines_are_found_as_exactly_as_bright_ones(scene, made):
    _, of_bright = AutomaticRequest(scene.field, scene.region).answer(Frame(scene.pixels))
    assert (
        error_mm(made, scene) < 1.0
        and abs(error_mm(made, scene) - error_mm(of_bright, scene)) < 0.1
    )


def test_dark_lines_are_checked(dark, made):
    found = check(made, dark)
    assert found["verdict"]["level"] == "good" and found["found_share"] > 0.9


def test_a_camera_above_dark_lines_that_has_moved_is_registered_again(scene, dark, made):
    moved = np.roll(dark, (6, 4), axis=(0, 1))
    summary, child = reregister(made, Frame(moved), before=Frame(dark))
    assert child.parent == made.id and 5 < summary["picture_px"] < 10


def test_a_camera_above_dark_lines_is_followed(dark, made):
    model, field, region = Restored.of(made)
    reference = LineReference.of([dark], model, field, region)
    assert reference is not None
    assert reference.look(dark).kind == "seen"
    sample = reference.look(np.roll(dark, 5, axis=1))
    assert sample.kind == "seen" and sample.moved.px > 3


@pytest.mark.parametrize("level", [0.0, 110.0])
def test_bright_lines_stay_bright_however_light_their_ground_is(scene, level):
    gray = opencv.to_grey(np.clip(0.5 * scene.pixels + level, 0, 255).astype(np.uint8))
    assert np.array_equal(with_bright_lines(gray), gray) and np.array_equal(
        painted_lines(gray).gray, gray
    )


def test_dark_lines_become_bright(dark):
    gray = opencv.to_grey(dark)
    assert np.array_equal(with_bright_lines(gray), 255 - gray) and np.array_equal(
        painted_lines(gray).gray, 255 - gray
    )


def test_a_picture_of_one_colour_has_no_lines():
    for level in (20, 200):
        gray = np.full((120, 160), level, np.uint8)
        assert painted_lines(gray).chains == () and np.array_equal(with_bright_lines(gray), gray)
