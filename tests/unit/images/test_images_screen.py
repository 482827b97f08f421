"""The header screen: honest pictures pass with their size, hostile ones are named, and no bytes get it to stumble."""

import struct

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.pictures import (
    HOSTILE,
    encoded,
    gradient,
    hostile,
    jpeg_with_size,
    lossless_webp,
    png_bomb,
)
from tests.support.tiers import rounds
from touchline.core.errors import BadImage, ImageTooLarge, TouchlineError
from touchline.images import DeclaredImage, ImageLimits, screen

FORMATS = {"png": "png", "jpg": "jpeg", "bmp": "bmp", "webp": "webp"}
SEEDS = [
    *map(encoded, FORMATS),
    encoded("jpg", gradient(16, 16), cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    encoded("webp", gradient(), cv2.IMWRITE_WEBP_QUALITY, 50),
]
BEGINNINGS = [b"", *(seed[:size] for seed in SEEDS for size in (2, 4, 12, 30))]
HOW = st.sampled_from(["set", "cut", "insert", "drop"])
EDITS = st.tuples(st.integers(0, 400), HOW, st.binary(min_size=1, max_size=6))


@pytest.mark.parametrize("suffix", FORMATS)
def test_an_honest_header_gives_format_and_size(suffix):
    assert screen(encoded(suffix, gradient(70, 30))) == DeclaredImage(FORMATS[suffix], 70, 30)


def test_a_lossy_webp_gives_its_size_too():
    assert screen(encoded("webp", gradient(70, 30), cv2.IMWRITE_WEBP_QUALITY, 50)) == DeclaredImage(
        "webp", 70, 30
    )


def test_a_top_down_bmp_has_a_positive_height():
    data = bytearray(encoded("bmp", gradient(8, 6)))
    data[22:26] = struct.pack("<i", -6)
    assert screen(bytes(data)) == DeclaredImage("bmp", 8, 6)


@pytest.mark.parametrize(
    "name", [n for n, (_, reason) in HOSTILE.items() if reason != "undecodable-image"]
)
def test_a_hostile_picture_is_refused_by_name_with_a_fix(name):
    data, reason = hostile(name)
    with pytest.raises(BadImage) as refusal:
        screen(data)
    assert refusal.value.reason == reason
    assert refusal.value.what.endswith(".") and refusal.value.fix.endswith(".")


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("text", "The file is not an image."),
        ("a TIFF", "This file is a TIFF image"),
        ("an AVIF", "This file is an AVIF or HEIC image"),
    ],
)
def test_a_refusal_of_an_unknown_format_says_what_came(name, what):
    with pytest.raises(BadImage, match=what):
        screen(hostile(name)[0])


@pytest.mark.parametrize(
    ("data", "limits"),
    [
        (encoded("png"), ImageLimits(max_bytes=100)),
        (encoded("png"), ImageLimits(max_pixels=64 * 48 - 1)),
        (encoded("bmp"), ImageLimits(max_side_px=63)),
        (lossless_webp(64, 49), ImageLimits(max_pixels=64 * 48)),
    ],
)
def test_what_is_beyond_a_limit_is_too_large(data, limits):
    with pytest.raises(ImageTooLarge):
        screen(data, limits)


def test_what_is_just_within_the_limits_passes():
    limits = ImageLimits(max_bytes=len(encoded("png")), max_pixels=64 * 48, max_side_px=64)
    assert screen(encoded("png"), limits) == DeclaredImage("png", 64, 48)


def test_a_flat_picture_of_a_common_size_is_no_bomb():
    assert screen(encoded("png", np.zeros((1080, 1920, 3), np.uint8))).width == 1920
    with pytest.raises(BadImage):
        screen(png_bomb(4000, 3000))


def test_a_gif_is_called_a_gif():
    with pytest.raises(BadImage, match="GIF"):
        screen(hostile("a GIF that asks for gigabytes")[0])


def test_an_extended_webp_declares_one_size_only():
    still = encoded("webp")[12:]
    canvas = (
        b"VP8X"
        + struct.pack("<I4B", 10, 0, 0, 0, 0)
        + (99).to_bytes(3, "little")
        + (47).to_bytes(3, "little")
    )
    data = b"RIFF" + struct.pack("<I", 4 + len(canvas) + len(still)) + b"WEBP" + canvas + still
    with pytest.raises(BadImage, match="two different sizes"):
        screen(data)
    agreeing = data.replace(
        (99).to_bytes(3, "little") + (47).to_bytes(3, "little"),
        (63).to_bytes(3, "little") + (47).to_bytes(3, "little"),
    )
    assert screen(agreeing) == DeclaredImage("webp", 64, 48)


def test_a_jpeg_that_says_its_size_twice_is_damaged():
    data = encoded("jpg")
    at = data.index(b"\xff\xc0")
    size = data[at : at + 19]
    with pytest.raises(BadImage, match="twice"):
        screen(data[:at] + size + data[at:])


@rounds("examples", 200, 3000)
def test_a_mutated_header_is_declared_within_limits_or_refused(examples):
    @settings(max_examples=examples, deadline=None)
    @given(seed=st.sampled_from(SEEDS), edits=st.lists(EDITS, min_size=1, max_size=8))
    def declared_or_refused(seed, edits):
        data = bytearray(seed)
        for at, how, with_bytes in edits:
            at = min(at, len(data))
            if how == "set":
                data[at : at + len(with_bytes)] = with_bytes
            elif how == "insert":
                data[at:at] = with_bytes
            else:
                del data[at : None if how == "cut" else at + len(with_bytes)]
        _declared_or_refused(bytes(data))

    declared_or_refused()


@rounds("examples", 100, 1000)
def test_any_bytes_are_declared_within_limits_or_refused(examples):
    @settings(max_examples=examples, deadline=None)
    @given(beginning=st.sampled_from(BEGINNINGS), tail=st.binary(max_size=200))
    def declared_or_refused(beginning, tail):
        _declared_or_refused(beginning + tail)

    declared_or_refused()


def _declared_or_refused(data):
    try:
        declared = screen(data)
    except TouchlineError as refusal:
        assert isinstance(refusal, BadImage)
    else:
        assert 1 <= declared.width <= 16_384 and 1 <= declared.height <= 16_384
        assert declared.width * declared.height <= 50_000_000


def test_an_overwritten_size_is_what_the_screen_reports():
    assert screen(jpeg_with_size(640, 480)) == DeclaredImage("jpeg", 640, 480)


def test_a_webp_part_of_odd_length_is_padded():
    still = encoded("webp")[12:]
    canvas = (
        b"VP8X"
        + struct.pack("<I4B", 10, 0x20, 0, 0, 0)
        + (63).to_bytes(3, "little")
        + (47).to_bytes(3, "little")
    )
    profile = b"ICCP" + struct.pack("<I", 3) + b"abc\0"
    body = b"WEBP" + canvas + profile + still
    assert screen(b"RIFF" + struct.pack("<I", len(body)) + body) == DeclaredImage("webp", 64, 48)
