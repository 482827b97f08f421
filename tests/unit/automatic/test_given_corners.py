"""Four corners of the covered area, a few pixels off, lead to its lines where the search of the picture does not."""

import cv2
import numpy as np
import pytest

from tests.support.auto_scenes import SceneSpec, camera_of, carpet_error_mm, fields, scene_of
from touchline.automatic.hypotheses import cameras_from_corners
from touchline.automatic.recognition import request_for
from touchline.automatic.request import AutomaticRequest
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize, with_z
from touchline.core.records import Frame
from touchline.models import field_from_raw, model_from_json

SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)
PAD_PX = 200  # about the picture: room for a floor of planks
PLANKS = 9  # on each side
FIELD = fields()[SPEC.field]
REGION = FIELD.region(SPEC.region)
PLACES = with_z(
    REGION.field_from_region(
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * np.array([REGION.width_mm, REGION.height_mm])
    )
)


@pytest.fixture(scope="module")
def scene():
    return scene_of(SPEC)


@pytest.fixture(scope="module")
def corners():
    """Of the region, raw px in the unpadded picture, each off by up to 8 px."""
    return camera_of(SPEC).raw_from_field(PLACES) + np.random.default_rng(1).uniform(-8, 8, (4, 2))


@pytest.fixture(scope="module")
def planks(scene):
    """The picture on a floor whose long bright lines are more than are matched with the field."""
    pixels = cv2.copyMakeBorder(
        scene.pixels, *4 * (PAD_PX,), cv2.BORDER_CONSTANT, value=(70, 70, 70)
    )
    height, width = pixels.shape[:2]
    rng = np.random.default_rng(1)
    for at in 20 + 18 * np.arange(PLANKS):
        slope = int(rng.integers(-3, 4))
        for ends in (
            ((10, at), (width - 10, at + slope)),
            ((10, height - at), (width - 10, height - at + slope)),
            ((at, PAD_PX), (at, height - PAD_PX)),
            ((width - at, PAD_PX), (width - at, height - PAD_PX)),
        ):
            cv2.line(pixels, *ends, (112, 112, 112), 2, cv2.LINE_AA)
    return np.clip(pixels + rng.normal(0, 2, pixels.shape), 0, 255).astype(np.uint8)


def test_with_the_corners_lines_are_found_that_the_search_does_not_find(scene, corners, planks):
    told, made = AutomaticRequest(FIELD, REGION).answer(Frame(planks))
    assert (made, told["verdict"]["reason"]) == (None, "no-match")
    rough = {"corners": (corners + PAD_PX).tolist()}
    told, made = AutomaticRequest(FIELD, REGION, rough=rough).answer(Frame(planks))
    assert made is not None and told["verdict"]["level"] == "good"
    model = model_from_json(made.model_name, made.model_parameters)
    assert carpet_error_mm(lambda raw: field_from_raw(model, raw + PAD_PX), scene)[0] < 1.0


def test_corners_that_are_far_off_do_not_mislead(scene, corners):
    rough = {"corners": (0.5 * (corners + corners.mean(axis=0))).tolist()}
    told, made = AutomaticRequest(FIELD, REGION, rough=rough).answer(Frame(scene.pixels))
    assert made is not None and told["verdict"]["level"] == "good"
    model = model_from_json(made.model_name, made.model_parameters)
    assert carpet_error_mm(lambda raw: field_from_raw(model, raw), scene)[0] < 1.0


def test_corners_decide_which_end_of_a_field_is_which(scene, corners):
    rough = {"corners": np.roll(corners, 2, axis=0).tolist()}
    told, made = AutomaticRequest(FIELD, REGION, rough=rough).answer(Frame(scene.pixels))
    assert made is not None and abs(told["candidates"][0]["turn_deg"]) > 170
    model = model_from_json(made.model_name, made.model_parameters)
    assert carpet_error_mm(lambda raw: -field_from_raw(model, raw), scene)[0] < 1.0


def test_each_camera_sees_the_corners_near_the_given_ones(corners):
    cameras = cameras_from_corners(corners, REGION, ImageSize(*SPEC.size))
    assert len(cameras) > 3 and len({float(camera.terms[0]) for camera in cameras}) == len(cameras)
    for camera in cameras:
        assert np.abs(camera.project(PLACES) - corners).max() < 12 and camera.position_mm[2] > 0


@pytest.mark.parametrize("order", [[1, 0, 2, 3], [3, 2, 1, 0], [0, 2, 1, 3], [0, 0, 1, 2]])
def test_corners_in_another_order_are_refused_before_anything_is_looked_for(corners, order):
    with pytest.raises(BadInput) as refused:
        AutomaticRequest(FIELD, REGION, rough={"corners": corners[order].tolist()})
    assert refused.value.reason == "bad-corners"


@pytest.mark.parametrize("given", [[[1, 2]] * 3, [[1, 2, 3]] * 4, [[1, None]] * 4, "corners"])
def test_what_is_not_four_pixels_is_refused(given):
    with pytest.raises(BadInput) as refused:
        AutomaticRequest(FIELD, REGION, rough={"corners": given})
    assert refused.value.reason == "bad-rough"


def test_corners_need_the_area_that_they_are_of(corners):
    with pytest.raises(BadInput) as refused:
        request_for(fields(), "ssl-div-b", "auto", None, rough={"corners": corners.tolist()})
    assert refused.value.reason == "bad-corners"
