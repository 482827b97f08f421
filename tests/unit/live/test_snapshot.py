"""A picture of many frames is of one camera that stood still, whatever moved before it."""

import threading

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import FIELDS, capturing
from tests.support.simulated_source import simulated_source
from touchline.core.errors import Unavailable
from touchline.live.capture import STILL_PX, take_still
from touchline.vision.background import camera_shift_px

SIM = "sim://table?size=480x384&fps=50&robots=3"


def test_a_camera_that_is_knocked_while_a_picture_of_many_frames_is_taken_gives_none():
    with capturing(SIM) as capture:
        capture.next(0, 20)
        assert take_still(capture, 5, 0.5, 20)[0]["frames"] == 5
        knock = threading.Timer(0.5, capture.set_control, ("knock", 8))
        knock.start()
        with pytest.raises(Unavailable) as refused:
            take_still(capture, 60, 15.0, 60)
        knock.join()
    assert refused.value.reason == "series-moved" and refused.value.fix


@pytest.mark.parametrize(
    "url",
    [
        "sim://ssl-div-b?size=640x512&robots=12&people=2&k1=-0.2",
        "sim://table?size=640x512&robots=8&people=4&glare=0.5",
        "sim://vsss-3v3?size=640x480&robots=6&people=1&drift=0.5&noise=4",
    ],
)
def test_robots_people_and_light_do_not_move_the_camera(url):
    rendering = simulated_source(url, FIELDS).rendering
    first = rendering.frame_at(0, 0.0)
    assert (
        max(
            camera_shift_px(first, rendering.frame_at(int(30 * s), s)) for s in (0.3, 1.0, 2.0, 4.0)
        )
        < STILL_PX / 2
    )


@pytest.mark.parametrize("px", [3, 6, 30])
def test_a_shift_of_the_whole_picture_is_one_of_the_camera(px):
    rendering = simulated_source(
        "sim://ssl-div-b?size=640x512&robots=12&people=2", FIELDS
    ).rendering
    moved = cv2.warpAffine(
        rendering.frame_at(90, 3.0),
        np.float64([[1, 0, 0.8 * px], [0, 1, 0.6 * px]]),
        (640, 512),
        borderMode=cv2.BORDER_REFLECT,
    )
    assert camera_shift_px(rendering.frame_at(0, 0.0), moved) == pytest.approx(px, rel=0.3)


def test_lamps_that_go_off_and_a_hand_before_the_lens_do_not_move_the_camera():
    seen = simulated_source("sim://table?size=640x512&robots=3&noise=3", FIELDS).rendering.frame_at(
        0, 0.0
    )
    noise = np.random.default_rng(0).integers(-3, 4, seen.shape)
    for other in (
        np.full_like(seen, 90),
        np.clip(0.04 * seen + noise, 0, 255).astype(np.uint8),
        np.clip(90 + noise, 0, 255).astype(np.uint8),
    ):
        assert camera_shift_px(seen, other) == 0.0
