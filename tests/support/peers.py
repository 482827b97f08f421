"""Somebody at the other end, for sources that are nothing without: the laws over all sources open these addresses."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

from tests.support.industrial import need_aravis
from tests.support.mjpeg_camera import MjpegCamera
from tests.support.plugged_cameras import Webcam, plug_in
from tests.support.rtp_sender import sent_to_group
from tests.support.rtsp_camera import RtspCamera
from touchline.sources.address import KEEP_THEIR_QUERY
from touchline.sources.v4l2 import V4l2Source

HOSTS = ("127.0.0.1",)  # where they are, for SourceContext.hosts
ADDRESSES = {  # of the sources that need no other end of their own
    "sim": "sim://table?size=320x256&fps=200&seed=3",
    "picture": "picture://grey.png?fps=200",
    "folder": "folder://shots?fps=200",
    "video": "video://film.avi?fps=200",
    "v4l2": "v4l2://0?fps=200",
    "aravis": "aravis://Fake_1?fps=200",  # simulated by the library
}


@contextlib.contextmanager
def address_of(name: str, pictures: Path, fps: float = 200) -> Iterator[str]:
    """An address of that source that opens and gives so many frames a second."""
    with FAR_ENDS.get(name, _alone)(name, pictures, fps) as url:
        yield url


def with_option(url: str, name: str, value: str) -> str:
    """The address with an option more, or with another value of one that it has."""
    sign = "#" if url.partition("://")[0] in KEEP_THEIR_QUERY else "?"
    address, found, options = url.partition(sign)
    kept = [pair for pair in options.split("&") if found and pair.partition("=")[0] != name]
    return address + sign + "&".join([*kept, f"{name}={value}"])


@contextlib.contextmanager
def _alone(name: str, pictures: Path, fps: float) -> Iterator[str]:
    _write_files(pictures)
    yield ADDRESSES[name].replace("fps=200", f"fps={fps:g}")


def _write_files(pictures: Path) -> None:
    """The files that the addresses of pictures, folders and films name."""
    (pictures / "shots").mkdir(exist_ok=True)
    for name, level in (("grey.png", 128), *((f"shots/shot-{i}.png", 60 * i) for i in range(3))):
        cv2.imwrite(str(pictures / name), np.full((24, 32, 3), level, np.uint8))
    film = cv2.VideoWriter(
        str(pictures / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25, (64, 48)
    )
    for i in range(5):
        film.write(np.full((48, 64, 3), 40 * i, np.uint8))
    film.release()


@contextlib.contextmanager
def _rtsp(_name: str, _pictures: Path, fps: float) -> Iterator[str]:
    with contextlib.closing(RtspCamera(fps=fps)) as camera:
        yield camera.url


@contextlib.contextmanager
def _datagrams(name: str, _pictures: Path, fps: float) -> Iterator[str]:
    form = {"rtp": "rtp", "udp": "mpegts"}[name]
    with sent_to_group(form, fps=fps, gop=5) as (url, _sender):
        yield url


@contextlib.contextmanager
def _http(name: str, _pictures: Path, fps: float) -> Iterator[str]:
    with contextlib.closing(MjpegCamera(fps=fps, tls=name == "https")) as camera:
        yield camera.url + "#trust=any"


@contextlib.contextmanager
def _v4l2(name: str, pictures: Path, fps: float) -> Iterator[str]:
    root = pictures.parent / "machine"
    plug_in(root, 0)
    with mock.patch.multiple(V4l2Source, root=root, opener=staticmethod(lambda node: Webcam())):
        yield ADDRESSES[name].replace("fps=200", f"fps={fps:g}")


@contextlib.contextmanager
def _aravis(name: str, pictures: Path, fps: float) -> Iterator[str]:
    need_aravis()
    with _alone(name, pictures, fps) as url:
        yield url


FAR_ENDS = {
    "rtsp": _rtsp,
    "rtp": _datagrams,
    "udp": _datagrams,
    "http": _http,
    "https": _http,
    "v4l2": _v4l2,
    "aravis": _aravis,
}
