"""Folders and films: every file that is meant is read, and none outside the pictures folder."""

import shutil
import time
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from tests.support.plugged_cameras import V4L2_PATHS
from tests.support.tiers import long
from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.images.in_process import decode_in_process
from touchline.sources import SourceContext, source_from_url

CANARY = 77  # the grey of the one picture that must not be seen
FILM = "fields/robocin/static.mp4"
FILMS = (
    "motion/foosball/sample.avi",
    "motion/pool_smartcue/2019_PoolChamp_Clip1.mp4",
    "motion/pool_smartcue/2019_PoolChamp_Clip2.mp4",
    "motion/pool_smartcue/2019_PoolChamp_Clip6.mp4",
    "motion/pool_smartcue/2019_PoolChamp_Clip9.mp4",
    "motion/pool_smartcue/2019_PoolChamp_Clip11.mp4",
    "motion/pool_smartcue/2019_PoolChamp_Clip15.mp4",
    "fields/robocin/all_tags.mp4",
    "fields/vss_sdk/robot_move.mp4",
)


@pytest.fixture
def around(tmp_path):
    (tmp_path / "pictures").mkdir()
    return SourceContext(decode=decode_in_process, pictures=tmp_path / "pictures")


def picture(grey: int, width: int = 32) -> bytes:
    return cv2.imencode(".png", np.full((24, width, 3), grey, np.uint8))[1].tobytes()


def film(path, frames: int = 10, fps: float = 20, size: tuple[int, int] = (64, 48)) -> None:
    """A film whose n-th frame has the grey 20 n."""
    codec = cv2.VideoWriter_fourcc(*("mp4v" if path.suffix == ".mp4" else "MJPG"))
    writer = cv2.VideoWriter(str(path), codec, fps, size)
    for n in range(frames):
        writer.write(np.full((size[1], size[0], 3), 20 * n, np.uint8))
    writer.release()


def shown(source, count: int) -> list[int]:
    """The n of so many frames."""
    return [round(source.read().pixels.mean() / 20) for _ in range(count)]


def test_a_folders_pictures_come_in_the_order_of_their_names_and_again(around):
    folder = around.pictures / "match 1"
    folder.mkdir()
    for name, n in (("img2.png", 2), ("img10.png", 3), ("img1.PNG", 1)):
        (folder / name).write_bytes(picture(20 * n))
    (folder / "notes.txt").write_text("no picture")
    (folder / "folder.png").mkdir()
    source = source_from_url("folder://match%201?fps=200", around)
    assert shown(source, 7) == [1, 2, 3, 1, 2, 3, 1]


def test_broken_pictures_in_a_folder_are_left_out_and_new_ones_come_with_the_next_round(around):
    for n in (1, 3):
        (around.pictures / f"{n}.png").write_bytes(picture(20 * n))
    (around.pictures / "2.png").write_bytes(picture(40)[:60])
    source = source_from_url("folder://.?fps=200", around)
    assert shown(source, 2) == [1, 3] and source.skipped == 1
    (around.pictures / "2.png").write_bytes(picture(40))
    assert shown(source, 3) == [1, 2, 3]


def test_pictures_of_another_size_are_given_as_they_are(around):
    (around.pictures / "1.png").write_bytes(picture(20))
    (around.pictures / "2.png").write_bytes(picture(40, width=48))
    source = source_from_url("folder://.?fps=200", around)
    assert [source.read().size.width for _ in range(3)] == [32, 48, 32]


def test_a_folder_shown_once_ends_and_an_empty_one_is_refused(around):
    with pytest.raises(Unavailable) as refused:
        source_from_url("folder://.", around)
    assert refused.value.reason == "no-pictures-there"
    (around.pictures / "1.png").write_bytes(picture(20))
    source = source_from_url("folder://.?loop=false&fps=200", around)
    source.read()
    for _ in range(2):
        with pytest.raises(Unavailable) as refused:
            source.read()
        assert refused.value.reason == "source-ended"
    (around.pictures / "1.png").write_bytes(b"broken")
    with pytest.raises(Unavailable, match="None of the images"):
        source_from_url("folder://.?fps=200", around).read()


@pytest.mark.parametrize("name", [FILM, *(long(name) for name in FILMS)])
def test_real_films_are_read_from_the_first_frame_to_the_last(name, around, real_data):
    path = real_data(name)
    shutil.copy(path, around.pictures / path.name)
    source = source_from_url(f"video://{path.name}?loop=false&pace=fast", around)
    first = source.read()
    count = 1
    with pytest.raises(Unavailable) as ended:
        while True:
            assert source.read().size == first.size
            count += 1
    assert ended.value.reason == "source-ended"
    told = cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT)
    assert count > 0.8 * told  # some of these films promise more frames than they hold


@pytest.mark.parametrize("suffix", ["avi", "mp4"])
def test_a_film_loops_frame_by_frame(suffix, around):
    film(around.pictures / f"film.{suffix}")
    source = source_from_url(f"video://film.{suffix}?pace=fast", around)
    assert shown(source, 25) == [*range(10), *range(10), *range(5)]


def test_the_first_frame_of_a_loop_is_one_interval_after_the_last_of_the_one_before(around):
    film(around.pictures / "film.avi")
    source = source_from_url("video://film.avi?pace=fast", around)
    moments_s = [source.moment_s for _ in range(22) if source.read()]
    np.testing.assert_allclose(np.diff(moments_s), 1 / 20, atol=1e-3)


def test_a_film_begins_where_it_is_told(around):
    film(around.pictures / "film.avi")
    source = source_from_url("video://film.avi?start_s=0.25&pace=fast", around)
    assert shown(source, 7) == [5, 6, 7, 8, 9, 5, 6]
    with pytest.raises(BadInput) as refused:
        source_from_url("video://film.avi?start_s=60", around)
    assert refused.value.reason == "undecodable-video"


def film_of(path, pictures) -> None:
    """A film of JPEGs, each of its own size."""
    with av.open(str(path), "w") as made:
        stream = made.add_stream("mjpeg", rate=20)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        for n, pixels in enumerate(pictures):
            packet = av.Packet(cv2.imencode(".jpg", pixels)[1].tobytes())
            packet.stream, packet.pts, packet.dts, packet.time_base = stream, n, n, Fraction(1, 20)
            made.mux(packet)


def test_a_film_may_change_its_size(around):
    """A recorder that goes on after the camera was set to another resolution writes such a film."""
    sizes = [(64, 48)] * 3 + [(96, 72)] * 3
    film_of(
        around.pictures / "film.avi",
        (np.full((h, w, 3), 20 * n, np.uint8) for n, (w, h) in enumerate(sizes)),
    )
    source = source_from_url("video://film.avi?pace=fast", around)
    seen = [source.read() for _ in sizes]
    assert [tuple(frame.size) for frame in seen] == sizes
    assert [round(frame.pixels.mean() / 20) for frame in seen] == list(range(6))


def test_a_frame_with_more_pixels_than_are_decoded_is_left_out(around):
    sides = (64, 7200, 96)  # the second has 52 million pixels in 300 kB
    film_of(around.pictures / "film.avi", (np.full((side, side), 100, np.uint8) for side in sides))
    source = source_from_url("video://film.avi?pace=fast", around)
    assert [source.read().size.width for _ in range(3)] == [64, 96, 64]


def test_a_film_is_shown_at_its_own_pace_over_its_loops_too(around):
    film(around.pictures / "film.avi")  # half a second
    source = source_from_url("video://film.avi", around)
    source.read()
    start = time.monotonic()
    shown(source, 20)
    assert 0.9 < time.monotonic() - start < 20


def test_a_film_as_fast_as_possible_does_not_wait_and_one_with_a_rate_keeps_it(around):
    film(around.pictures / "slow.avi", fps=1)
    start = time.monotonic()
    shown(source_from_url("video://slow.avi?pace=fast", around), 30)
    assert time.monotonic() - start < 20  # it would be 29 s
    start = time.monotonic()
    shown(source_from_url("video://slow.avi?fps=50", around), 26)
    assert 0.45 < time.monotonic() - start < 20


@pytest.mark.parametrize("loops", [30, long(100)])
def test_a_hundred_loops_keep_no_memory_no_file_and_no_thread(around, loops):
    import gc
    from pathlib import Path

    film(around.pictures / "film.avi", size=(640, 480))
    source = source_from_url("video://film.avi?pace=fast", around)

    def held() -> tuple[int, int, int]:
        status = dict(
            line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines()
        )
        return (
            int(status["VmRSS"].split()[0]),
            len(list(Path("/proc/self/fd").iterdir())),
            int(status["Threads"]),
        )

    shown(source, 100)
    gc.collect()  # what earlier tests have left would be closed meanwhile
    before = held()
    shown(source, 10 * loops)
    after = held()
    assert after[0] - before[0] < 20_000  # kB; one frame a loop kept would be 27,000 and more
    assert after[1] == before[1] and after[2] <= before[2]


def test_a_playlist_that_calls_itself_a_film_opens_nothing(around):
    film(around.pictures / "real.avi")
    neighbour = around.pictures.parent / "secret.avi"
    film(neighbour)
    texts = {
        "concat.mp4": f"ffconcat version 1.0\nfile '{neighbour}'\n",
        "list.mkv": f"#EXTM3U\n#EXTINF:1,\n{neighbour}\n",
        "stream.mov": f"v=0\nm=video 5000 RTP/AVP 26\nc=IN IP4 127.0.0.1\n#{neighbour}\n",
        "empty.avi": "",
    }
    for name, text in texts.items():
        (around.pictures / name).write_text(text)
        with pytest.raises(BadInput) as refused:
            source_from_url(f"video://{name}", around)
        assert refused.value.reason == "unknown-video-format"
    (around.pictures / "film.txt").write_bytes((around.pictures / "real.avi").read_bytes())
    with pytest.raises(BadInput):
        source_from_url("video://film.txt", around)
    # With a film's first bytes it comes further: FFmpeg itself has no such containers any more.
    (around.pictures / "list.mp4").write_bytes(b"#EXTftyp" + texts["list.mkv"].encode())
    (around.pictures / "broken.avi").write_bytes(b"RIFF\0\0\0\0AVI " + bytes(2000))
    for name in ("list.mp4", "broken.avi"):
        with pytest.raises(BadInput) as refused:
            source_from_url(f"video://{name}", around)
        assert refused.value.reason == "undecodable-video"


def test_ffmpeg_itself_opens_no_playlist(tmp_path):
    from touchline.sources.ffmpeg import VideoDecoder

    real = tmp_path / "film.avi"
    film(real)
    for name, text in (
        ("list.ffconcat", f"ffconcat version 1.0\nfile '{real}'\n"),
        ("list.m3u8", f"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfile://{real}\n"),
    ):
        (tmp_path / name).write_text(text)
        assert VideoDecoder.open(str(tmp_path / name)) is None
    assert VideoDecoder.open(f"concat:{real}") is None
    decoder = VideoDecoder.open(str(real))
    assert decoder is not None and decoder.read() is not None
    decoder.close()


def traversals(root) -> list[str]:
    """Ways to write the path of a file outside the folder."""
    outside = root.parent
    names = ["secret", f"{outside}/secret", "link", "folder-link/secret", "loop"]
    names += [
        prefix + "secret"
        for prefix in (
            "../",
            "..%2f",
            "%2e%2e/",
            "%2e%2e%2f",
            "..%252f",
            "%252e%252e%252f",
            "....//",
            "..//",
            ".././",
            "./../",
            "..\\",
            "..%5c",
            "%c0%ae%c0%ae/",
            "..%c0%af",
            "..;/",
            "%00../",
            "../%00",
            "folder/../../",
            "folder/..%2f../",
            "//../",
            f"/proc/self/cwd/{outside}/",
            f"/proc/self/root{outside}/",
            f"/proc/1/root{outside}/",
            "/dev/fd/../../../",
            f"file:{outside}/",
            f"file://{outside}/",
            f"concat:{outside}/",
            f"subfile,,start,0,end,0,,:{outside}/",
            f"cache:{outside}/",
            f"async:{outside}/",
            f"crypto:{outside}/",
            f"data:{outside}/",
            f"pipe:{outside}/",
            f"tee:{outside}/",
            f"ffconcat:{outside}/",
            "~/",
            "~root/",
            "$PWD/../",
            "${PWD}/../",
            "`pwd`/../",
            "*/../../",
            "folder%0a/../../",
            "folder%0d%0a../../",
            "．．/",
            "‥/",
            "..／",
            "folder/%2e%2e/%2e%2e/",
            "/" * 40 + "../",
        )
    ]
    names += (
        [f"{name}%00.png" for name in names]
        + [f"{name}%20" for name in names]
        + [f"{name}?x" for name in names]
    )
    names += [f"/proc/self/fd/{n}" for n in range(12)] + [
        "/dev/stdin",
        "/dev/zero",
        "/etc/passwd",
        "/dev/video0",
        "%02d",
        "img%02d",
        "[a-z]*",
        *V4L2_PATHS,
    ]
    return names


def test_five_hundred_ways_out_of_the_folder_show_nothing(around):
    """The canary is a picture, a film and a folder of pictures beside the pictures folder."""
    root = around.pictures
    outside = root.parent
    (root / "folder").mkdir()
    (root / "folder-link").symlink_to(outside)
    (root / "loop").symlink_to(root / "loop")
    (outside / "secret").mkdir()
    for name in ("secret.png", "secret/1.png"):
        (outside / name).write_bytes(picture(CANARY))
    film(outside / "secret.avi", size=(32, 24))
    for suffix in ("", ".png", ".avi"):
        (root / f"link{suffix}").symlink_to(outside / f"secret{suffix}")
    tried = 0
    for name in traversals(root):
        for url in (
            f"picture://{name}.png",
            f"picture://{name}",
            f"video://{name}.avi",
            f"folder://{name}",
        ):
            tried += 1
            try:
                frame = source_from_url(url, around).read()
            except TouchlineError:
                continue
            pytest.fail(f"{url} showed a picture of grey {frame.pixels.mean():.0f}")
    assert tried >= 500


def test_a_link_that_stays_in_the_folder_is_followed(around):
    (around.pictures / "1.png").write_bytes(picture(20))
    (around.pictures / "newest.png").symlink_to(around.pictures / "1.png")
    assert shown(source_from_url("picture://newest.png", around), 1) == [1]
