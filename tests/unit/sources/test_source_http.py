"""HTTP cameras: MJPEG as cameras really send it, and everything that can be wrong with it."""

import contextlib
import random
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.mjpeg_camera import BOUNDARY, MjpegCamera, coded
from tests.support.paths import SHARED_DATA
from tests.support.pictures import HOSTILE, hostile, jpeg_of_many_scans, jpeg_with_size
from tests.support.waiting import until
from touchline.core.errors import BadImage, Unavailable
from touchline.images.in_process import decode_in_process, read_in_process
from touchline.images.screen import screen
from touchline.sources import SourceContext, source_from_url
from touchline.sources.network.http_mjpeg import (
    MAX_PART,
    MultipartParser,
    PartTooLarge,
    boundary_of,
)

AROUND = SourceContext(decode=decode_in_process, read=read_in_process, hosts=("127.0.0.1",))
SEEN_S = 20.0  # generous, for a busy machine


@pytest.fixture
def camera():
    with contextlib.closing(MjpegCamera()) as one:
        yield one


@pytest.fixture
def source(camera):
    with contextlib.closing(source_from_url(camera.url, AROUND)) as opened:
        yield opened


def ending(source) -> tuple[float, str]:
    """Read until it fails: after how long, and why."""
    start = time.monotonic()
    with pytest.raises(Unavailable) as ended:
        while True:
            source.read()
            assert time.monotonic() - start < SEEN_S
    return time.monotonic() - start, ended.value.reason


def bar(frame) -> int:
    """The n that the picture tells."""
    return int(np.argmax(frame.pixels[frame.size.height // 2, :, 0] > 140)) // 16


FORMS = {
    "as it should be": {},
    "without lengths": {"with_length": False},
    "in chunks": {"chunked": True},
    "in chunks without lengths": {"chunked": True, "with_length": False},
    "boundary in quotes": {"announced": f'multipart/x-mixed-replace; boundary="{BOUNDARY}"'},
    "dashes announced too": {"announced": f"multipart/x-mixed-replace;boundary=--{BOUNDARY}"},
    "dashes announced and sent twice": {
        "announced": f"multipart/x-mixed-replace;boundary=--{BOUNDARY}",
        "mark": f"----{BOUNDARY}",
    },
    "dashes sent twice, without lengths": {"mark": f"----{BOUNDARY}", "with_length": False},
    "shouting": {"announced": f"Multipart/X-Mixed-Replace; Boundary={BOUNDARY}"},
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_every_form_of_the_stream_gives_each_picture_once(camera, form):
    for name, value in form.items():
        setattr(camera, name, value)
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        assert [bar(source.read()) for _ in range(25)] == [
            n % 20 for n in range(25)
        ] and source.skipped == 0
    assert camera.requests[0][0] == "/video?resolution=320x240"


def test_a_picture_is_given_when_it_is_whole_though_no_length_was_told(camera):
    camera.with_length, camera.fps = False, 0.05
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        start = time.monotonic()
        source.read()
        assert time.monotonic() - start < 15  # not with the next one, twenty seconds later


@pytest.mark.parametrize("kind", ["basic", "digest"])
def test_a_camera_that_asks_for_a_login_gets_it(camera, kind):
    camera.login = kind
    for url in (camera.url, camera.picture_url):
        with contextlib.closing(
            source_from_url(url.replace("://", "://op:s3cret%2F@") + "#fps=100", AROUND)
        ) as source:
            assert [source.read().size.width for _ in range(5)] == [320] * 5
            assert "s3cret" not in repr(source.identity())
    for wrong in (camera.url, camera.url.replace("://", "://op:wrong@")):
        with pytest.raises(Unavailable) as refused:
            source_from_url(wrong, AROUND)
        assert refused.value.reason == "camera-login"
    sent = [headers.get("authorization", "") for _, headers in camera.requests]
    assert kind == "basic" or not any("Basic" in text for text in sent)


def test_a_single_picture_is_asked_for_again_and_again_at_the_wanted_rate(camera):
    with contextlib.closing(source_from_url(camera.picture_url + "#fps=20", AROUND)) as source:
        start = time.monotonic()
        seen = [bar(source.read()) for _ in range(11)]
        assert 0.45 < time.monotonic() - start < SEEN_S
    assert seen == [(seen[0] + i) % 20 for i in range(11)]
    assert camera.connections == 1  # it stays open
    camera.drop()


def test_a_single_picture_is_asked_for_anew_when_the_camera_hangs_up_between(camera):
    with contextlib.closing(source_from_url(camera.picture_url + "#fps=50", AROUND)) as source:
        source.read()
        camera.drop()
        time.sleep(0.1)
        assert source.read().size.width == 320


def test_every_connection_is_our_own_and_pinned(camera, monkeypatch):
    """The standard library's client would connect by itself, to wherever the name leads by then."""
    monkeypatch.setattr(
        "http.client.HTTPConnection.connect", lambda client: pytest.fail("it connected by itself")
    )
    camera.hangs_up = True
    with contextlib.closing(source_from_url(camera.picture_url + "#fps=50", AROUND)) as source:
        for _ in range(4):
            source.read()
    assert camera.connections == 4


def test_a_new_size_is_seen_with_the_first_picture_that_has_it(camera, source):
    sizes = set()
    for size in ((640, 480), (64, 48), (320, 240)):
        camera.size = size
        start = time.monotonic()
        while tuple(source.read().size) != size:
            assert time.monotonic() - start < SEEN_S
        sizes.add(size)
    assert len(sizes) == 3 and source.skipped == 0


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


def test_a_camera_that_loses_its_power_or_never_answers_is_seen(camera, source):
    source.read()
    camera.drop()
    assert ending(source)[1] == "camera-gone"
    camera.mute = True
    start = time.monotonic()
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == "camera-silent" and time.monotonic() - start < SEEN_S
    camera.close()
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == "camera-unreachable"


@pytest.mark.parametrize(
    ("status", "reason"),
    [
        ("404 Not Found", "unknown-stream"),
        ("403 No", "camera-login"),
        ("503 Busy", "camera-refuses"),
        ("301 Moved", "camera-redirects"),
    ],
)
def test_a_cameras_refusal_is_told_in_words(camera, status, reason):
    camera.status = status
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == reason


def test_a_page_is_no_camera(camera):
    camera.announced = "text/html"
    with pytest.raises(Unavailable) as refused:
        source_from_url(camera.url, AROUND)
    assert refused.value.reason == "unknown-stream"


def test_odd_parts_between_the_pictures_are_left_out_and_counted(camera):
    odd = [
        b"",
        b"rubbish" * 200,
        coded(3)[:900],
        b"--" + BOUNDARY.encode(),
        b"\xff\xd8\xff\xd9",
        bytes(70_000),
    ]
    camera.parts = lambda n: [odd[n % len(odd)], coded(n)]
    camera.with_length = False
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        assert [bar(source.read()) for _ in range(13)] == list(range(13))
        assert source.skipped >= 10


def test_nothing_but_odd_parts_is_no_stream_of_pictures(camera):
    camera.fps, camera.parts = 1000, lambda n: [b"rubbish" * 20]
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        assert ending(source)[1] == "bad-pictures"
    camera.fps = 5
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        assert ending(source)[1] == "bad-pictures"


def test_pictures_that_only_their_headers_are_whole_of_are_no_stream_of_pictures(camera):
    """Nobody else may look at them for long: here one a second is decoded to see."""
    damaged = bytearray(coded(0))
    damaged[damaged.index(b"\xff\xdb") + 4] = 0x0F  # a table that no picture has
    assert not is_screened_out(bytes(damaged))
    camera.fps, camera.parts = 200, lambda n: [bytes(damaged)]
    with (
        pytest.raises(Unavailable) as refused,
        contextlib.closing(source_from_url(camera.url, AROUND)) as source,
    ):
        source.read()
    assert refused.value.reason == "bad-pictures"


def test_what_nobody_looks_at_is_not_decoded(camera, monkeypatch):
    decoded = []
    decode = cv2.imdecode
    monkeypatch.setattr(cv2, "imdecode", lambda *how: decoded.append(how) or decode(*how))
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        begun = time.monotonic()
        for _ in range(25):
            source.read()
        assert 1 <= len(decoded) <= 2 + (time.monotonic() - begun)


def test_a_part_of_nine_megabytes_is_not_taken_in(camera):
    parts = {5: bytes(MAX_PART + 1_000_000), 8: coded(8) + bytes(MAX_PART)}
    camera.parts = lambda n: [parts.get(n, coded(n))]
    for camera.with_length in (True, False):
        with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
            seen = [bar(source.read()) for _ in range(12)]
            assert 5 not in seen and seen[-1] >= 12 and source.skipped >= 2


def is_screened_out(data: bytes) -> bool:
    try:
        screen(data)
    except BadImage:
        return True
    return False


def test_bombs_and_damaged_pictures_in_the_stream_do_not_end_it(camera, real_data):
    """Ours, and those beside the project where they are."""
    bombs = [data for data, _ in map(hostile, HOSTILE) if 0 < len(data) < MAX_PART]
    bombs += [jpeg_with_size(60_000, 60_000), jpeg_with_size(64, 4000), jpeg_of_many_scans(1000)]
    folder = SHARED_DATA / "hostile_images"
    if folder.is_dir():
        bombs += [
            path.read_bytes()
            for path in sorted(folder.iterdir())
            if path.suffix != ".txt" and path.stat().st_size < MAX_PART
        ]
    refused = []
    for data in bombs:
        try:
            decode_in_process(data)
        except BadImage:
            refused.append(data)
    assert len(refused) > 30
    camera.fps = 1000
    camera.parts = lambda n: [refused[n], coded(n)] if n < len(refused) else [coded(0, (64, 48))]
    with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
        seen = []
        while (frame := source.read()).size.width != 64:
            # of one whose header is fine, whoever wants its pixels is refused them
            with contextlib.suppress(BadImage):
                seen.append(bar(frame))
        assert seen == [n % 20 for n in range(len(refused))]
        assert source.skipped >= sum(1 for data in refused if is_screened_out(data))
    if not folder.is_dir():
        pytest.skip(
            f"{len(refused)} of our own were sent; real data is not beside the project: hostile_images"
        )


def test_a_self_made_certificate_is_taken_only_where_that_is_asked_for():
    with contextlib.closing(MjpegCamera(tls=True)) as camera:
        with pytest.raises(Unavailable) as refused:
            source_from_url(camera.url, AROUND)
        assert refused.value.reason == "camera-certificate" and "#trust=any" in refused.value.fix
        with contextlib.closing(source_from_url(camera.url + "#trust=any", AROUND)) as source:
            assert [bar(source.read()) for _ in range(5)] == list(range(5))
            camera.stalled = True
            assert ending(source)[1] == "camera-silent"


def test_fifty_openings_and_failures_keep_no_descriptor_and_no_thread(camera):
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
    for i in range(50):
        cycle(i % 2 == 0)
    # The camera's own threads notice with their next picture.
    until(held, lambda now: now[0] <= before[0] and now[1] <= before[1])


@pytest.mark.parametrize(
    "said",
    [
        b"",
        b"\0" * 5000,
        b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 5000,
        b"HTTP/1.1 200 OK\r\nX: " + b"y" * 200_000,
        b"HTTP/1.1 100 Continue\r\n\r\n" * 200,
        b"RTSP/1.0 200 OK\r\n\r\n",
        b"HTTP/1.1 \xff\r\n\r\n",
        b"HTTP/1.1 401 No\r\nWWW-Authenticate: Digest\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\nno",
        b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=\r\n\r\n--\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    ],
    ids=range(11),
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
        url = f"http://127.0.0.1:{server.server_address[1]}/#fps=200"
        with pytest.raises(Unavailable), contextlib.closing(source_from_url(url, AROUND)) as source:
            source.read()
        server.shutdown()


def test_a_stream_in_any_pieces_gives_the_same_parts():
    sent = [coded(n) for n in range(6)]
    stream = (
        b"".join(
            b"--x\r\nContent-Type: image/jpeg\r\n"
            + (b"Content-Length: %d\r\n" % len(p) if i % 2 else b"")
            + b"\r\n"
            + p
            + b"\r\n"
            for i, p in enumerate(sent)
        )
        + b"--x--"
    )
    for seed in range(30):
        cuts = random.Random(seed)
        reader, got, at = MultipartParser(b"x"), [], 0
        while at < len(stream):
            step = cuts.choice((1, 2, 3, 50, 1000, 20_000))
            got += reader.feed(stream[at : at + step])
            at += step
        assert got == sent


@pytest.mark.parametrize(
    ("kind", "boundary"),
    [
        ("multipart/x-mixed-replace; boundary=a", b"a"),
        ('multipart/mixed;x=y; BOUNDARY="--a b"', b"a b"),
        ("image/jpeg", None),
        ("multipart/x-mixed-replace", None),
        ("multipart/x-mixed-replace; boundary=--", None),
        ("text/html; boundary=a", None),
        ("", None),
    ],
)
def test_the_boundary_is_what_the_content_type_announces(kind, boundary):
    assert boundary_of(kind) == boundary


def test_a_stream_without_any_boundary_is_too_much_at_some_point():
    reader = MultipartParser(b"x")
    with pytest.raises(PartTooLarge):
        for _ in range(100):
            list(reader.feed(bytes(100_000)))
    with pytest.raises(PartTooLarge):
        list(reader.feed(b"--x\r\n" + b"A: b\r\n" * 5000))
    with pytest.raises(PartTooLarge):
        list(reader.feed(b"--x\r\n\r\n" + bytes(MAX_PART + 1) + b"\r\n--x\r\n\r\n"))
    assert list(reader.feed(b"ok\r\n--x")) == [b"ok"]  # and goes on behind it
