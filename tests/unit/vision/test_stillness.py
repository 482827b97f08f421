"""A frozen picture, under a running clock or not, beside pictures whose noise nobody sees."""

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from touchline.vision.zones import LONG_S, Stillness

EVERY_S = 0.5
SCENE = cv2.GaussianBlur(np.random.default_rng(5).normal(110, 60, (240, 320)), (0, 0), 4).clip(
    0, 255
)


def noisy(seconds, level=2.0, scene=SCENE):
    random = np.random.default_rng(1)
    return [
        (scene + random.normal(0, level, scene.shape)).clip(0, 255).astype(np.uint8)
        for _ in range(round(seconds / EVERY_S))
    ]


def frozen(seconds, picture):
    """The same picture again and again, but for a clock."""
    for number in range(round(seconds / EVERY_S)):
        shown = picture.copy()
        cv2.putText(shown, f"{number:04d}", (4, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 255, 2)
        yield shown


def jpegs(pictures, quality):
    return [
        cv2.imdecode(
            cv2.imencode(".jpg", one, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE
        )
        for one in pictures
    ]


def h264(pictures, key_frame_s, crf=37):
    coder, decoder = av.CodecContext.create("libx264", "w"), av.CodecContext.create("h264", "r")
    coder.height, coder.width, coder.pix_fmt, coder.time_base = (
        *SCENE.shape,
        "yuv420p",
        Fraction(1, 2),
    )
    coder.options = {"crf": str(crf), "preset": "veryfast", "tune": "zerolatency"}
    coder.gop_size = round(key_frame_s / EVERY_S)
    for one in pictures:
        for packet in coder.encode(
            av.VideoFrame.from_ndarray(cv2.cvtColor(one, cv2.COLOR_GRAY2BGR), format="bgr24")
        ):
            yield from (frame.to_ndarray(format="gray") for frame in decoder.decode(packet))


def last(pictures):
    stillness, found = Stillness(), []
    for number, picture in enumerate(pictures):
        found.append(stillness.add(picture, EVERY_S * number))
    return found[-1], max(one["share"] for one in found)


@pytest.mark.parametrize(
    "sent",
    [lambda all: all, lambda all: jpegs(all, 75), lambda all: jpegs(all, 30)],
    ids=["raw", "JPEG 75", "JPEG 30"],
)
def test_noise_tells_a_live_picture_from_a_frozen_one_under_a_running_clock(sent):
    before = noisy(26)
    live, share = last(sent(before))
    assert live["had_noise"] and live["most_s"] < 2 and share == 0
    stopped, share = last(sent([*before, *frozen(24, before[-1])]))
    assert (
        stopped["had_noise"]
        and stopped["most_s"] >= LONG_S
        and stopped["all_s"] < 1
        and share > 0.9
    )
    never, _ = last(sent(list(frozen(24, before[-1]))))
    assert not never["had_noise"] and never["most_s"] >= LONG_S


def test_a_picture_that_is_coded_from_frame_to_frame_stays_the_same_up_to_the_next_key_frame():
    still, share = last(h264(noisy(40), 10))
    assert still["all_s"] > 3 and share < 0.05  # longer than FROZEN_S, and nobody touched it
    still, share = last(h264(noisy(40), 100))
    assert share > 0.5 and not still["had_noise"]  # as frozen as a frozen one


def test_what_is_black_or_white_is_not_counted_and_another_size_begins_anew():
    dark, _ = last([np.full((240, 320), 4, np.uint8)] * 60)
    assert (
        dark["most_s"] is None
        and dark["share"] == 0
        and not dark["had_noise"]
        and dark["all_s"] == 29.5
    )
    half = SCENE.copy()
    half[:, :160] = 0
    found, share = last(noisy(30, scene=half))
    assert found["had_noise"] and share == 0
    stillness = Stillness()
    for number, picture in enumerate([*noisy(30), np.full((100, 100, 3), 90, np.uint8)]):
        found = stillness.add(picture, EVERY_S * number)
    assert not found["had_noise"] and found["all_s"] == 0
