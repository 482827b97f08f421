"""An industrial camera's bytes as a picture: every format, against a scene of known colours."""

import cv2
import numpy as np
import pytest

from touchline.core.errors import Unavailable
from touchline.sources.industrial.camera import (
    PIXEL_FORMATS,
    best_format,
    bgr_from_raw,
    canonical_name,
)

WIDTH, HEIGHT = 48, 32
CORNERS = (("R", "G"), ("G", "B"))


def scene() -> np.ndarray:
    """Smooth in each colour and different in all three, so that no mix-up stays unseen. (HEIGHT, WIDTH, 3) BGR."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return np.stack((40 + 3 * x, 60 + 4 * y, 200 - 2 * x), axis=-1).astype(np.uint8)


def bytes_of(name: str) -> bytes:
    """The scene as such a camera would send it, written down from the format's definition."""
    bgr = scene()
    if name == "Mono8":
        return bgr[..., 1].tobytes()
    if name.startswith("Bayer"):
        channel = {"B": 0, "G": 1, "R": 2}
        # the first row's colours; the second row has the third colour, diagonally to the first's
        first = name[5:7]
        second = {"RG": "GB", "GR": "BG", "GB": "RG", "BG": "GR"}[first]
        mosaic = np.empty((HEIGHT, WIDTH), np.uint8)
        for row, pair in enumerate((first, second)):
            for column, colour in enumerate(pair):
                mosaic[row::2, column::2] = bgr[row::2, column::2, channel[colour]]
        return mosaic.tobytes()
    if "422" in name:
        blue, green, red = (bgr[..., i].astype(float) for i in range(3))
        luma = 0.299 * red + 0.587 * green + 0.114 * blue
        blueness, redness = 128 + 0.564 * (blue - luma), 128 + 0.713 * (red - luma)
        chroma = np.empty_like(luma)
        chroma[:, 0::2], chroma[:, 1::2] = blueness[:, 0::2], redness[:, 0::2]
        pair = (chroma, luma) if name.endswith(("UYVY", "CbYCrY")) else (luma, chroma)
        return np.stack(pair, axis=-1).round().astype(np.uint8).tobytes()
    order = {"BGR8": (0, 1, 2), "RGB8": (2, 1, 0), "BGRa8": (0, 1, 2), "RGBa8": (2, 1, 0)}[name]
    channels = [bgr[..., i] for i in order]
    if name.endswith("a8"):
        channels.append(np.full((HEIGHT, WIDTH), 7, np.uint8))
    return np.stack(channels, axis=-1).tobytes()


@pytest.mark.parametrize("name", PIXEL_FORMATS)
def test_every_format_shows_the_colours_of_the_scene(name):
    pixels = bgr_from_raw(bytes_of(name), WIDTH, HEIGHT, PIXEL_FORMATS[name].code)
    expected = scene() if name != "Mono8" else cv2.cvtColor(scene()[..., 1], cv2.COLOR_GRAY2BGR)
    assert (
        pixels.shape == (HEIGHT, WIDTH, 3)
        and pixels.flags.c_contiguous
        and not pixels.flags.writeable
    )
    inner = np.s_[2:-2, 2:-2]  # a mosaic's border has only half its neighbours
    # A pixel's missing colours are its neighbours', which differ by up to 4 grey levels here; a mix-up differs by 100.
    assert np.abs(pixels[inner].astype(int) - expected[inner]).max() <= 6


@pytest.mark.parametrize("name", PIXEL_FORMATS)
def test_padding_after_each_row_and_bytes_after_the_picture_are_left_out(name):
    row = WIDTH * PIXEL_FORMATS[name].bytes_per_pixel
    rows = np.frombuffer(bytes_of(name), np.uint8).reshape(HEIGHT, row)
    padded = np.hstack((rows, np.full((HEIGHT, 5), 255, np.uint8))).tobytes()
    plain = bgr_from_raw(bytes_of(name), WIDTH, HEIGHT, PIXEL_FORMATS[name].code)
    assert (
        bgr_from_raw(padded + b"chunk data", WIDTH, HEIGHT, PIXEL_FORMATS[name].code, 5) == plain
    ).all()
    # none after the last
    assert (bgr_from_raw(padded[:-5], WIDTH, HEIGHT, PIXEL_FORMATS[name].code, 5) == plain).all()


@pytest.mark.parametrize("name", PIXEL_FORMATS)
def test_a_picture_of_which_bytes_are_missing_is_none(name):
    assert bgr_from_raw(bytes_of(name)[:-1], WIDTH, HEIGHT, PIXEL_FORMATS[name].code) is None
    assert bgr_from_raw(b"", WIDTH, HEIGHT, PIXEL_FORMATS[name].code) is None


@pytest.mark.parametrize(
    ("width", "height", "padding"),
    [
        (0, 32, 0),
        (48, 0, 0),
        (-48, 32, 0),
        (48, -32, 0),
        (1, 1, 0),
        (40000, 1, 0),
        (48, 32, -1),
        (2**31, 2**31, 0),
    ],
)
@pytest.mark.parametrize("name", ["Mono8", "BayerRG8", "YUV422_8"])
def test_a_size_that_no_camera_has_is_none(name, width, height, padding):
    assert bgr_from_raw(bytes(100_000), width, height, PIXEL_FORMATS[name].code, padding) is None


@pytest.mark.parametrize("name", [name for name in PIXEL_FORMATS if "422" in name])
def test_an_odd_width_loses_the_column_that_has_half_a_colour(name):
    pixels = bgr_from_raw(bytes(47 * 32 * 2), 47, 32, PIXEL_FORMATS[name].code)
    assert pixels.shape == (32, 46, 3)


def test_the_picture_is_a_copy():
    raw = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pixels = bgr_from_raw(raw, WIDTH, HEIGHT, PIXEL_FORMATS["BGR8"].code)
    raw[:] = 255
    assert not pixels.any()


def test_an_unknown_format_is_told_with_the_known_ones():
    with pytest.raises(Unavailable, match="0x01100003") as refused:  # Mono10
        bgr_from_raw(bytes(100_000), WIDTH, HEIGHT, 0x01100003)
    assert refused.value.reason == "pixel-format" and "Mono8" in refused.value.fix


def test_colour_in_few_bytes_is_preferred_and_old_names_are_known():
    assert best_format(["Mono8", "RGB8", "BayerGB8", "Mono16"]) == "BayerGB8"
    assert (
        best_format(["Mono12", "RGB8Packed", "Mono8"]) == "RGB8Packed"
        and canonical_name("RGB8Packed") == "RGB8"
    )
    assert best_format(["Mono12Packed"]) is None and best_format([]) is None
