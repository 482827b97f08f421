"""RTSP cameras: a small one of our own, and GStreamer's real server with the codecs that cameras have."""

import contextlib
import os
import socket
import threading
import time
from itertools import pairwise
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from tests.support.gst_camera import GstCamera, installed
from tests.support.rtsp_camera import RtspCamera, scene
from tests.support.tiers import long
from tests.support.waiting import LONG_S, until
from touchline.core.errors import Unavailable
from touchline.images.in_process import JpegFrame, read_in_process
from touchline.sources import SourceContext, source_from_url
from touchline.sources.network.endpoint import Endpoint
from touchline.sources.network.rtsp import RtspRelay

AROUND = SourceContext(read=read_in_process, hosts=("127.0.0.1",))
SEEN_S = 20.0  # generous, for a busy machine; the bench measures


@pytest.fixture
def camera():
    with contextlib.closing(RtspCamera()) as one:
        yield one


@pytest.fixture
def source(camera):
    with contextlib.closing(source_from_url(camera.url, AROUND)) as opened:
        yield opened


def read_until(source, wanted) -> float:
    """Read until a frame is as wanted, and how long that took."""
    start = time.monotonic()
    while not wanted(source.read()):
        assert time.monotonic() - start < LONG_S  # an encoder in software, on a busy machine
    return time.monotonic() - start


def ending(source) -> tuple[float, str]:
    """Read until it fails: after how long, and why."""
    start = time.monotonic()
    with pytest.raises(Unavailable) as ended:
        while True:
            source.read()
            assert time.monotonic() - start < SEEN_S
    return time.monotonic() - start, ended.value.reason


def test_a_request_without_a_number_ends_the_relay_and_it_says_so():
    camera, _far = socket.socketpair()
    with contextlib.closing(
        RtspRelay(camera, Endpoint.of("rtsp", "camera/"), stall_s=LONG_S)
    ) as relay:
        with socket.create_connection(("127.0.0.1", urlsplit(relay.url).port)) as stranger:
            stranger.sendall(f"OPTIONS {relay.url} RTSP/1.0\r\n\r\n".encode())
            relay._thread.join(LONG_S)
        assert relay.problem is not None and relay.problem.reason == "camera-gone"


def test_pictures_come_as_they_were_sent_one_after_the_other(source):
    seen = []
    for _ in range(30):
        pixels = source.read().pixels
        seen.append(int(np.argmax(pixels[120, :, 0] > 140)) // 16)
        assert np.abs(pixels.astype(int) - scene(seen[-1])).mean() < 3
    assert all((later - sooner) % 20 == 1 for sooner, later in pairwise(seen))


@pytest.mark.parametrize("kind", ["basic", "digest"])
def test_a_camera_that_asks_for_a_login_gets_it_and_nobody_else_does(camera, kind):
    camera.login = kind
    url = camera.url.replace("://", "://op:s3cret%2F@")
    with contextlib.closing(source_from_url(url, AROUND)) as source:
        assert source.read().size.width == 320
        assert "s3cret" not in repr(source.identity()) and source.identity().address.startswith(
            "rtsp://op@127.0.0.1"
        )
    for wrong in (camera.url, camera.url.replace("://", "://op:wrong@")):
        with pytest.raises(Unavailable) as refused:
            source_from_url(wrong, AROUND)
        assert refused.value.reason == "camera-login"
    sent = [headers.get("authorization", "") for _, _, headers in camera.requests]
    assert kind == "basic" or not any("Basic" in text for text in sent)


def test_the_camera_is_asked_under_its_own_name_and_the_query_reaches_it(camera, source):
    source.read()
    assert {uri.partition("/live")[0] for _, uri, _ in camera.requests} == {
        f"rtsp://127.0.0.1:{camera.port}"
    }
    assert camera.requests[0][1].endswith("/live?channel=1&subtype=0")
    assert all("TCP" in headers.get("transport", "TCP") for _, _, headers in camera.requests)


def test_a_new_size_is_followed_and_never_bent_to_the_old_one(camera, source):
    source.read()
    for size in ((640, 480), (320, 240), (640, 240)):
        camera.size = size
        read_until(source, lambda frame, size=size: tuple(frame.size) == size)
        bar = source.read().pixels[:, :, 0] > 140
        assert np.ptp(np.flatnonzero(bar.all(axis=0))) == 15  # 16 px wide, as it was drawn


@pytest.mark.parametrize("fault", ["stalled", "half", "trickle"])
def test_a_camera_that_falls_silent_is_seen_and_comes_back(camera, source, fault):
    source.read()
    setattr(camera, fault, True)
    took, reason = ending(source)
    assert reason == "camera-silent" and took < SEEN_S
    setattr(camera, fault, False)
    camera.stalled = False
    with contextlib.closing(source_from_url(camera.url, AROUND)) as again:
        assert again.read().size.width == 320


def test_a_camera_that_may_take_long_to_open_may_not_be_silent_for_as_long_afterwards(camera):
    with contextlib.closing(source_from_url(camera.url + "#open_s=25", AROUND)) as source:
        source.read()
        camera.stalled = True
        took, reason = ending(source)
        assert reason == "camera-silent" and took < SEEN_S


def test_a_camera_that_loses_its_power_is_seen_at_once(camera, source):
    source.read()
    camera.drop()
    assert ending(source)[1] == "camera-gone"


def test_a_camera_that_never_answers_holds_nobody(camera):
    camera.mute = True
    start = time.monotonic()
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == "camera-silent" and time.monotonic() - start < SEEN_S
    camera.close()
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == "camera-unreachable"


@pytest.mark.parametrize("times", [8, long(50)])
def test_fifty_openings_and_failures_keep_no_descriptor_and_no_thread(camera, times):
    def held() -> tuple[int, int]:
        return len(list(Path("/proc/self/fd").iterdir())), threading.active_count()

    def cycle(fault: bool) -> None:
        source = source_from_url(camera.url, AROUND)
        source.read()
        if fault:
            camera.drop()
            ending(source)
        source.close()

    cycle(True)
    time.sleep(0.3)
    before = held()
    for i in range(times):
        cycle(i % 2 == 0)
    # The camera's own threads take a moment to end.
    until(held, lambda now: now[0] <= before[0] and now[1] <= before[1])


@pytest.mark.parametrize(
    "said",
    [
        b"RTSP/1.0 200 OK\r\n\r\n" * 20,
        b"\0" * 5000,
        b"$\0\xff\xff" + bytes(200),
        b"RTSP/1.0 200 OK\r\nCSeq: 1\r\n" * 50_000,
        b"RTSP/1.0 200 OK\r\nCSeq: 1\r\nContent-Length: 999999999\r\n\r\n",
        b"HTTP/1.1 200 OK\r\n\r\n",
        b"RTSP/1.0 200 OK\r\nCSeq: 99999999999999999999\r\n\r\n",
        b"OPTIONS * RTSP/1.0\r\nCSeq: 1\r\n\r\n" * 100,
        b"",
        b"RTSP/1.0 200 \xff\xfe\r\nCSeq: x\r\n\r\n",
    ],
    ids=range(10),
)
def test_rubbish_from_a_camera_ends_in_a_refusal(said):
    import socketserver

    class Rubbish(socketserver.BaseRequestHandler):
        def handle(self):
            with contextlib.suppress(OSError):
                self.request.recv(4096)
                self.request.sendall(said)

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Rubbish) as server:
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        with pytest.raises(Unavailable):
            source_from_url(f"rtsp://127.0.0.1:{server.server_address[1]}/x", AROUND)
        server.shutdown()


@pytest.mark.parametrize(
    "around", [AROUND, SourceContext(hosts=("127.0.0.1",))], ids=["passed on", "decoded"]
)
def test_pictures_that_no_decoder_understands_are_left_out(camera, around):
    with contextlib.closing(source_from_url(camera.url, around)) as source:
        source.read()
        camera.garbage = 10
        seen = [source.read() for _ in range(40)]
        assert camera.garbage == 0 and all(tuple(frame.size) == (320, 240) for frame in seen)


def test_a_jpeg_is_passed_on_as_it_came_and_any_viewer_shows_it(source):
    frame = source.read()
    assert isinstance(frame, JpegFrame) and frame.is_plain
    assert (
        np.abs(
            frame.pixels.astype(int) - scene(int(np.argmax(frame.pixels[120, :, 0] > 140)) // 16)
        ).mean()
        < 3
    )


def gst(codec: str, gop: int = 25):
    if not installed():
        (pytest.fail if os.environ.get("TOUCHLINE_TESTS") == "all" else pytest.skip)(
            "GStreamer's RTSP server is not installed; tests/support/gst_camera.py says which packages it needs"
        )
    return contextlib.closing(GstCamera(codec, gop))


@pytest.mark.parametrize("codec", ["h264", "h265", "mjpeg", "vp8"])
def test_a_real_server_is_read_and_its_size_followed(codec):
    with (
        gst(codec) as camera,
        contextlib.closing(source_from_url(camera.url + "#open_s=25", AROUND)) as source,
    ):
        first = source.read()
        assert tuple(first.size) == (320, 240)
        # of the television's colour bars
        white, green = (first.pixels[120, x].astype(int) for x in (20, 160))
        assert white.min() > 170 and green[1] > 170 and green[[0, 2]].max() < 60
        for size in ((640, 480), (320, 240)):
            camera.resize(*size)
            read_until(source, lambda frame, size=size: tuple(frame.size) == size)
