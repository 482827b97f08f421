"""A camera's own JPEG goes to whoever watches as it came, where its size and quality allow."""

import asyncio

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import live
from tests.support.mjpeg_camera import MjpegCamera, coded
from tests.support.pictures import encoded, gradient, turned_jpeg
from tests.support.waiting import LONG_S, until_async
from touchline.images import read_in_process
from touchline.live.messages import StreamSpec
from touchline.live.picture import passed_on
from touchline.processes.framing import decode_body


def watched(camera: MjpegCamera, spec: StreamSpec, count: int = 5) -> list[tuple[dict, bytes]]:
    async def story():
        async with live(camera.url) as seen:
            await until_async(lambda: seen.status()["state"] == "live")
            with seen.watching(spec) as viewer:
                bodies = [decode_body(await viewer.next(LONG_S)) for _ in range(count)]
            return [(head, bytes(jpeg)) for head, jpeg in bodies]

    return asyncio.run(story())


@pytest.fixture
def camera():
    camera = MjpegCamera()
    yield camera
    camera.close()


@pytest.mark.parametrize("width", [0, 320, 960])
def test_a_viewer_gets_the_cameras_own_bytes(camera, width):
    sent = {coded(n) for n in range(20)}
    for head, jpeg in watched(camera, StreamSpec.requested("raw", width)):
        assert jpeg in sent and (head["width"], head["height"], head["calibration"]) == (
            320,
            240,
            None,
        )


@pytest.mark.parametrize(("width", "quality"), [(160, 80), (0, 10)])
def test_one_who_wants_less_gets_a_picture_of_its_own(camera, width, quality):
    sent = {coded(n) for n in range(20)}
    for head, jpeg in watched(camera, StreamSpec.requested("raw", width, quality), 3):
        picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert jpeg not in sent and picture.shape[:2] == (head["height"], head["width"])
        assert head["width"] == (width or 320)


def test_only_what_serves_as_it_is_is_passed_on():
    rng = np.random.default_rng(0)
    fine = read_in_process(encoded("jpg", gradient(640, 480)))
    grain = rng.integers(0, 255, (480, 640, 3), np.uint8)
    grainy = read_in_process(encoded("jpg", grain, cv2.IMWRITE_JPEG_QUALITY, 95))
    assert (
        passed_on(fine, StreamSpec("raw", 640, 80))
        == fine.jpeg
        == passed_on(fine, StreamSpec("raw", 0, 80))
    )
    for spec in (
        StreamSpec("raw", 480, 80),
        StreamSpec("corrected", 0, 80),
        StreamSpec("side", 0, 80),
    ):
        assert passed_on(fine, spec) == b""
    # three times as large as one of that quality
    assert passed_on(grainy, StreamSpec("raw", 0, 80)) == b""
    assert passed_on(grainy, StreamSpec("raw", 0, 95)) == grainy.jpeg
    assert (
        passed_on(read_in_process(encoded("png", gradient(640, 480))), StreamSpec("raw", 0, 80))
        == b""
    )
    turned = turned_jpeg("Exif behind comments", encoded("jpg", gradient(1920, 1080)))
    assert passed_on(read_in_process(turned), StreamSpec("raw", 0, 80)) == b""
