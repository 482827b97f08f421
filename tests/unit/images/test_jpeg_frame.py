"""A camera's JPEG: decoded once, when its pixels are wanted, and smaller where that will do."""

from threading import Barrier, Thread

import cv2
import numpy as np
import pytest

from tests.support.pictures import (
    COMMENTS,
    TURN,
    TURNED,
    encoded,
    gradient,
    jpeg_segment,
    turned_jpeg,
)
from touchline.core.errors import BadImage
from touchline.images import read_in_process


@pytest.fixture
def decodings(monkeypatch) -> list[int]:
    """The flags of each decoding, from now on."""
    flags: list[int] = []
    decode = cv2.imdecode
    monkeypatch.setattr(
        cv2, "imdecode", lambda data, flag: flags.append(flag) or decode(data, flag)
    )
    return flags


def test_its_size_is_known_before_it_is_decoded_and_it_is_decoded_once(decodings):
    data = encoded("jpg", gradient(640, 480))
    frame = read_in_process(data)
    assert tuple(frame.size) == (640, 480) and frame.jpeg == data and decodings == []
    together = Barrier(4)

    def look() -> None:
        together.wait()
        assert frame.pixels.shape == (480, 640, 3)

    threads = [Thread(target=look) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(decodings) == 1 and not frame.pixels.flags.writeable
    np.testing.assert_array_equal(
        frame.pixels, cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    )


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        ((640, 1), (640, 480)),
        ((321, 1), (640, 480)),
        ((320, 1), (320, 240)),
        ((161, 1), (320, 240)),
        ((100, 100), (160, 120)),
        ((1, 100), (160, 120)),
        ((1, 1), (80, 60)),
    ],
)
def test_it_is_read_no_larger_than_needed_and_no_smaller(decodings, asked, given):
    frame = read_in_process(encoded("jpg", gradient(640, 480)))
    small = frame.reduced(*asked)
    assert small.shape == (given[1], given[0], 3) and len(decodings) == 1
    whole = cv2.resize(frame.pixels, given, interpolation=cv2.INTER_AREA)
    assert np.abs(small.astype(int) - whole).max() <= 4


def test_an_odd_size_is_rounded_up_and_what_is_decoded_is_not_read_again(decodings):
    frame = read_in_process(encoded("jpg", gradient(641, 483)))
    assert frame.reduced(200).shape == (242, 321, 3)
    assert frame.pixels.shape == (483, 641, 3) and frame.reduced(80).shape == (483, 641, 3)
    assert len(decodings) == 2


def test_what_comes_after_its_end_is_not_its_own():
    data = encoded("jpg", gradient(64, 48))
    assert read_in_process(data + bytes(5000)).jpeg == data


def test_another_format_is_decoded_at_once(decodings):
    frame = read_in_process(encoded("png", gradient(64, 48)))
    assert frame.jpeg == b"" and len(decodings) == 1 and frame.reduced(8).shape == (48, 64, 3)


def test_one_that_cannot_be_decoded_says_so_when_its_pixels_are_wanted():
    data = bytearray(encoded("jpg", gradient(640, 480)))
    tables = data.index(b"\xff\xdb")
    data[tables + 4] = 0x0F  # a table that no picture has
    frame = read_in_process(bytes(data))
    for wanted in (lambda: frame.pixels, lambda: frame.reduced(100)):
        with pytest.raises(BadImage):
            wanted()


@pytest.mark.parametrize("name", TURNED)
def test_a_picture_that_viewers_would_turn_is_not_plain_and_not_turned_here(name):
    data = turned_jpeg(name, encoded("jpg", gradient(64, 48)))
    # as a viewer shows it
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).shape == (64, 48, 3)
    frame = read_in_process(data)
    assert not frame.is_plain and frame.pixels.shape == (48, 64, 3)


def test_a_picture_with_long_comments_or_the_letters_of_exif_in_one_is_plain():
    plain = encoded("jpg", gradient(64, 48))
    for between in (b"", COMMENTS, jpeg_segment(0xFE, TURN)):
        assert read_in_process(plain[:2] + between + plain[2:]).is_plain


def test_a_picture_whose_huffman_tables_are_left_to_its_viewer_is_not_plain():
    plain = encoded("jpg", gradient(64, 48))
    first, end = plain.index(b"\xff\xc4"), plain.index(b"\xff\xda")
    tables = plain[first:end]
    assert not read_in_process(plain[:first] + plain[end:]).is_plain
    assert not read_in_process(plain[:first] + jpeg_segment(0xFE, tables) + plain[end:]).is_plain
