"""Pictures that ask their viewer to turn them: the page gets them as the server sees them."""

import cv2
import numpy as np
import pytest

from tests.support.pictures import TURNED, encoded, turned_jpeg, turned_png, turned_webp
from tests.support.refusals import API
from touchline.detection.store import ClipRepository

WIDTH, HEIGHT = 64, 48


def shown(answer) -> np.ndarray:
    """What a viewer makes of it, which turns a picture that says so."""
    assert answer.status_code == 200, answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)


@pytest.mark.parametrize("name", TURNED)
def test_a_frame_of_a_clip_is_shown_as_it_is_detected_in(standing, name):
    data = turned_jpeg(name, encoded("jpg"))
    clip = standing.app.state.services.store.repository(ClipRepository).add(
        "north",
        {
            "width": WIDTH,
            "height": HEIGHT,
            "frames": [{"seq": 1, "time_s": 0.0, "bytes": len(data)}],
        },
        data,
    )
    assert shown(standing.get(f"{API}/clips/{clip.id}/frames/0.jpg")).shape == (HEIGHT, WIDTH, 3)


def test_a_frame_of_a_clip_that_asks_for_nothing_is_the_cameras_own(standing):
    data = encoded("jpg")
    clip = standing.app.state.services.store.repository(ClipRepository).add(
        "north",
        {
            "width": WIDTH,
            "height": HEIGHT,
            "frames": [{"seq": 1, "time_s": 0.0, "bytes": len(data)}],
        },
        data,
    )
    assert standing.get(f"{API}/clips/{clip.id}/frames/0.jpg").content == data


@pytest.mark.parametrize(
    "data",
    [turned_jpeg("Exif behind comments", encoded("jpg")), turned_png(), turned_webp()],
    ids=["JPEG", "PNG", "WebP"],
)
def test_an_uploaded_image_is_shown_as_it_is_calibrated_from(standing, data):
    # turned
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape == (WIDTH, HEIGHT, 3)
    kept = standing.post(f"{API}/snapshots", files={"file": data}).json()
    assert (kept["width"], kept["height"]) == (WIDTH, HEIGHT)
    for format in ("jpg", "png"):
        assert shown(standing.get(f"{API}/snapshots/{kept['id']}/image.{format}")).shape == (
            HEIGHT,
            WIDTH,
            3,
        )
