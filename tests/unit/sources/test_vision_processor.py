"""vision-processor's streams: only the camera's own pictures are used, and its cameras are found."""

import subprocess
import sys
from contextlib import closing, contextmanager

import numpy as np
import pytest

from tests.support.paths import ROOT
from tests.support.rtp_sender import carpet, computed_views, packets_of, sent_to_group
from tests.support.waiting import until
from touchline.core.errors import Unavailable
from touchline.images.in_process import decode_in_process
from touchline.sources import SourceContext, source_from_url
from touchline.sources.network.datagrams import Stream
from touchline.sources.network.rtp import read_rtp
from touchline.sources.network.vision_processor import is_computed_view
from touchline.store.fields import load_fields

AROUND = SourceContext(load_fields(), decode_in_process, hosts=("127.0.0.1",))
NAMESPACE = ["unshare", "--user", "--net", "--map-root-user"]
RAW, REPROJECTED = (640, 480), (576, 416)
PHASES = ("raw", "flat", "gradient", "blobs")  # each is shown for 20 s


@pytest.fixture(scope="module")
def views() -> dict[str, np.ndarray]:
    with closing(
        source_from_url(f"sim://ssl-div-b?size={RAW[0]}x{RAW[1]}&robots=6&seed=4", AROUND)
    ) as camera:
        raw = camera.read().pixels
    width, height = REPROJECTED
    return {"raw": raw, **computed_views(raw[:height, :width])}


@contextmanager
def vision_processor(views, phase: str):
    with sent_to_group(pictures=lambda n: views[phase], gop=30) as (url, sender):
        yield url, lambda phase: setattr(sender, "pictures", lambda n: views[phase])


@pytest.mark.parametrize("phase", PHASES)
def test_each_view_is_known_by_itself_at_its_first_picture_and_later(views, phase):
    stream, seen = Stream(96), []
    for data in packets_of(lambda n: views[phase], 12, gop=6):
        seen += [is_computed_view(one) for one in stream.push(data, read_rtp(data))]
    assert len(seen) >= 12 and set(seen) == {phase != "raw"}


@pytest.mark.parametrize("colour", [0, 60, 126, 200, 255])
def test_an_even_picture_in_colour_or_a_grey_one_is_the_cameras_own(colour):
    for picture in (
        np.full((96, 128, 3), (60, colour, 40), np.uint8),
        carpet(3, 160, 128).mean(2).astype(np.uint8),
        # its carpet adds up to the sum of a flat view, and no more
        np.where(np.arange(128)[:, None] < 40, np.uint8((200, 40, colour)), np.uint8((60, 240, 82)))
        .repeat(96, 0)
        .reshape(128, 96, 3),
    ):
        stream, seen = Stream(96), []
        for data in packets_of(lambda n, picture=picture: picture, 4):
            seen += [is_computed_view(one) for one in stream.push(data, read_rtp(data))]
        assert seen and not any(seen)


@pytest.mark.parametrize("phase", PHASES)
def test_only_the_raw_picture_is_shown_whenever_one_connects(views, phase):
    with vision_processor(views, phase) as (url, show):
        if phase == "raw":
            with closing(source_from_url(url + "&open_s=30", AROUND)) as camera:
                assert tuple(camera.read().size) == RAW
                show("flat")
                with pytest.raises(Unavailable, match="computed") as refused:
                    until(lambda: tuple(camera.read().size) != RAW)
        else:
            with pytest.raises(Unavailable, match="computed") as refused:
                source_from_url(url + "&open_s=30", AROUND)
            with closing(source_from_url(url + "&open_s=30&views=all", AROUND)) as camera:
                assert tuple(camera.read().size) == REPROJECTED
            show("raw")
            until(lambda: opens_with(url + "&open_s=30", RAW))
        assert refused.value.reason == "computed-view" and "raw_feed: true" in refused.value.fix


def opens_with(url: str, size: tuple[int, int]) -> bool:
    try:
        with closing(source_from_url(url, AROUND)) as camera:
            return tuple(camera.read().size) == size
    except Unavailable as refused:
        assert refused.reason == "computed-view"
        return False


def test_its_cameras_are_found_where_there_is_multicast_and_none_where_there_is_not():
    allowed = subprocess.run([*NAMESPACE, "true"], capture_output=True)
    if allowed.returncode:
        pytest.skip("this system lets nobody make a network namespace: finding was not tried")
    done = subprocess.run(
        [*NAMESPACE, sys.executable, "-m", "tests.support.stream_story"],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.split("\n")[-2] == "found"
