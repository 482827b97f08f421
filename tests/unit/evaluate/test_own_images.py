"""One stream under two cameras, and two cables exchanged, on rigs whose halves and quarters look alike."""

from itertools import permutations

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import FIELDS
from tests.support.simulated_source import simulated_source
from tests.support.tiers import rounds
from touchline.core.geometry import ImageSize
from touchline.evaluate.site_claims import CameraImage, compare, own_images_claim, whose
from touchline.sources import device_of
from touchline.vision.picture_print import PicturePrint

SIZE = ImageSize(320, 256)
RIG = "sim://ssl-div-b?cameras={}&camera={}&size=320x256&fps=240&tilt=3&play=field&robots={}"


def rig(count, robots):
    return [
        simulated_source(RIG.format(count, number, robots), FIELDS).rendering
        for number in range(count)
    ]


def sent(picture):
    """The same by another way: half as large, darker, compressed."""
    small = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    dark = cv2.convertScaleAbs(small, alpha=0.8, beta=5)
    return cv2.imdecode(
        cv2.imencode(".jpg", dark, [cv2.IMWRITE_JPEG_QUALITY, 60])[1], cv2.IMREAD_COLOR
    )


def printed(picture):
    made = PicturePrint.of(picture)
    assert made is not None
    return made


@pytest.fixture(scope="module")
def halves():
    """Of two cameras: the print of the calibration image, of a picture minutes later, and of that sent otherwise."""
    pictures = [
        (one.frame_at(0, 0.0), one.frame_at(900 + number, 300.0))
        for number, one in enumerate(rig(2, 6))
    ]
    return [(printed(then), printed(now), printed(sent(now))) for then, now in pictures]


def image(now, then, area="left", **more):
    return CameraImage(**{"now": now, "then": then, "size": SIZE, "area": ("hall", area), **more})


def claim_of(*images):
    titles = dict(zip("abc", ("North", "South", "East"), strict=True))
    return next(own_images_claim(titles, dict(zip("abc", images, strict=False))), None)


def test_each_camera_that_shows_its_own_half_is_held(halves):
    (then_a, now_a, _), (then_b, now_b, _) = halves
    assert compare(image(now_a, then_a), image(now_b, then_b, "right")) == "apart"
    assert claim_of(image(now_a, then_a), image(now_b, then_b, "right")).state == "held"
    # nothing to be taken for another
    assert claim_of(image(now_a, then_a)) is None and claim_of() is None


@pytest.mark.parametrize("known", ["both", "first", "second"])
def test_exchanged_cables_are_told_by_the_images_that_the_cameras_were_calibrated_from(
    halves, known
):
    (then_a, now_a, _), (then_b, now_b, _) = halves
    a = image(now_b, then_a if known != "second" else None)
    b = image(now_a, then_b if known != "first" else None, "right")
    told = claim_of(a, b)
    assert told.is_problem and "exchanged" in told.title and told.fix and told.cure == "camera"
    assert "North shows the image of South" in told.evidence or known == "first"


def test_one_stream_under_two_cameras_is_told_however_it_is_sent_and_whatever_it_was_calibrated_from(
    halves,
):
    (then_a, now_a, again_a), (then_b, _, _) = halves
    for then in (then_b, then_a, None):
        told = claim_of(image(now_a, then_a), image(again_a, then, "right"))
        assert (
            told.is_problem and "same image" in told.title and told.evidence == "North and South."
        )
    # its versions tell, too
    assert compare(image(None, then_a), image(None, again_a, "right")) == "image"
    not_calibrated = image(again_a, None, "right", size=None)
    assert compare(image(now_a, None, size=None), not_calibrated) == "image"
    # two cameras over one area may be so
    assert compare(image(now_a, then_a), image(again_a, then_a)) == "unknown"


def test_what_was_not_seen_or_cannot_be_told_apart_is_not_held(halves):
    (then_a, now_a, _), (then_b, now_b, _) = halves
    dark = claim_of(image(now_a, then_a), image(None, then_b, "right"))
    assert (
        dark.state == "not-tested"
        and "not compared" in dark.title
        and "South" in dark.evidence
        and not dark.gates
    )
    # nothing to compare with
    assert claim_of(image(now_a, None), image(now_b, None, "right")).state == "not-tested"
    assert (
        claim_of(image(now_a, None), image(now_b, None, "right", size=ImageSize(640, 480))).state
        == "held"
    )
    third = claim_of(image(now_a, then_a), image(now_b, then_b, "right"), image(None, None, "top"))
    assert third.state == "not-tested" and "East" in third.evidence


def test_a_picture_of_nothing_has_no_print_and_texts_of_others_give_none():
    noise = np.random.default_rng(1).normal(12, 2, (1024, 1280, 3)).clip(0, 255).astype(np.uint8)
    assert (
        PicturePrint.of(noise) is None and PicturePrint.of(np.full((48, 64), 90, np.uint8)) is None
    )
    made = printed(np.random.default_rng(1).integers(0, 255, (480, 640), np.uint8))
    again = PicturePrint.from_text(made.to_text())
    assert again is not None and np.array_equal(again.values, made.values)
    assert PicturePrint.from_text("AAAA") is None and PicturePrint.from_text("§") is None


@rounds("count", 4, 2)
def test_robots_and_people_exchange_nothing_on_symmetric_rigs(count):
    cameras = rig(count, "22&people=2")
    then = [printed(one.frame_at(number, 0.0)) for number, one in enumerate(cameras)]
    for second in (60, 300, 900):
        now = [
            printed(one.frame_at(second + number, float(second)))
            for number, one in enumerate(cameras)
        ]
        for a, b in permutations(range(count), 2):
            assert (
                whose(now[a], then[a], then[b]) == "own"
                and whose(now[b], then[a], then[b]) == "other"
            )
            assert compare(image(now[a], then[a], a), image(now[b], then[b], b)) == "apart"


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("rtsp://10.0.0.4/live", "rtsp://admin:secret@10.0.0.4:554/live/#open_s=5", True),
        ("http://CAM.local/video.mjpg", "http://cam.local./video.mjpg#fps=3", True),
        ("rtsp://10.0.0.4/ch1", "rtsp://10.0.0.4/ch2", False),
        ("rtsp://h/live?ch=1", "rtsp://h/live?ch=2", False),
        ("rtsp://10.0.0.4/live", "rtsp://10.0.0.5/live", False),
        ("v4l2:///dev/video0?size=640x480", "v4l2:///dev/video0", True),
        ("v4l2:///dev/video0", "v4l2:///dev/video1", False),
        ("sim://ssl-div-b?cameras=2&camera=0", "sim://ssl-div-b?camera=0&cameras=2", True),
        ("sim://ssl-div-b?cameras=2&camera=0", "sim://ssl-div-b?cameras=2&camera=1", False),
    ],
)
def test_two_addresses_are_of_one_device_whatever_options_and_passwords_they_have(one, other, same):
    assert (device_of(one) == device_of(other)) is same and device_of(one)
    assert device_of("no address") == "" == device_of("rtsp://host:port/live")
    assert compare(CameraImage(device_of(one)), CameraImage(device_of(other))) == (
        "address" if same else "unknown"
    )
