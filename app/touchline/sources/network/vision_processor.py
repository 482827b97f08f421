"""The league's vision-processor as a camera: its addresses, and which of its pictures are the camera's own.

It sends each camera as RTP to 224.5.23.100 + its number, port 10100. Once it is calibrated it shows in turn, for 20 s
each, the camera's picture and three that it has computed, unless its config.yml has stream: raw_feed: true
(Resources.cpp, main.cpp). Each can be told by itself (kernel/resampling.cl, f2nv12.cl):

flat:  each pixel is (2r - g - b + 510) / 4, and so on: red, green and blue always add up to 382.5.
gradient, blobs: one number a pixel, 127 for none, and both colour differences the same all over.
"""

import contextlib
import select
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from touchline.network.address import MulticastAddress, NetworkError, interfaces
from touchline.network.multicast import MulticastReceiver
from touchline.sources.network.rtp import read_rtp

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

GROUP_BASE, PORT = "224.5.23.", 10100
FIRST, CAMERAS = 100, 16
LISTEN_S = 1.0  # at 30 pictures a second each stream is heard long before
MAX_INTERFACES = 8
STEP = 4  # of the pixels of the colour planes one in each direction is looked at
FLAT_SUM = 381.4  # 382.5 less what is cut off by whole numbers
MIDDLE = 127
# Measured on 70 pictures of fields with a noise of up to 4 grey levels: 106 to 127, and 2 to 32, mostly below 17
# around 127. None of the pictures themselves, without their colours, is as even.
GREY_MEDIAN, GREY_SPREAD = (105, 130), 24


def is_computed_view(frame: "VideoFrame") -> bool:
    """Tell whether a picture is a computed view; False for what is not YUV 4:2:0, which vision-processor sends.

    A grey camera's own picture is told from the grey views by its brightness: theirs is near 127 nearly everywhere.
    """
    if frame.format.name != "yuv420p" or min(frame.width, frame.height) < 4 * STEP:
        return False
    u, v = (_plane(frame, i)[::STEP, ::STEP] for i in (1, 2))
    y = _plane(frame, 0)[: 2 * u.shape[0] * STEP : 2 * STEP, : 2 * u.shape[1] * STEP : 2 * STEP]
    if all(np.ptp(np.percentile(plane, (1, 99))) <= 2 for plane in (u, v)):
        low, high = GREY_MEDIAN
        return bool(low <= np.median(y) <= high and np.median(np.abs(y - MIDDLE)) <= GREY_SPREAD)
    # of BT.601: 3 × 1.164, 2.017 − 0.392, 1.596 − 0.813
    off = np.abs(3.492 * (y - 16) + 1.625 * (u - 128) + 0.783 * (v - 128) - FLAT_SUM)
    return bool(np.median(off) <= 8 and np.percentile(off, 95) <= 24)


def _plane(frame: "VideoFrame", i: int) -> np.ndarray[Any, Any]:
    plane = frame.planes[i]
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)
    return rows[:, : plane.width].astype(np.float32)


def find_streams(listen_s: float = LISTEN_S) -> list[tuple[str, int, int]]:
    """Listen to all cameras' groups on all interfaces: addresses as sources, camera numbers, how many send there.

    Nothing is sent but the requests to join. Where there is no multicast nothing is found.
    """
    heard: dict[tuple[int, str], set[str]] = {}
    with contextlib.ExitStack() as opened:
        poll, lines = select.poll(), {}
        for camera, interface, line in _receivers():
            opened.enter_context(contextlib.closing(line))
            lines[line.fileno()] = camera, interface, line
            poll.register(line, select.POLLIN)
        until = time.monotonic() + listen_s
        while lines and (left_s := until - time.monotonic()) > 0:
            for number, _ in poll.poll(left_s * 1000):
                camera, interface, line = lines[number]
                with contextlib.suppress(OSError):
                    found = line.receive(0)
                    if found and (packet := read_rtp(found.data)) and packet.carries_video:
                        senders = heard.setdefault((camera, interface), set())
                        if len(senders) < CAMERAS:
                            senders.add(found.address)
    answer = {}
    for (camera, interface), senders in sorted(
        heard.items(), reverse=True
    ):  # "": the last, it wins
        address = f"rtp://{GROUP_BASE}{FIRST + camera}:{PORT}"
        answer[camera] = address + f"?interface={interface}" * bool(interface), camera, len(senders)
    return [answer[camera] for camera in sorted(answer)]


def _receivers() -> Iterator[tuple[int, str, MulticastReceiver]]:
    names = [str(one["name"]) for one in interfaces() if one["address"]]
    for interface in ("", *names[:MAX_INTERFACES]):
        for camera in range(CAMERAS):
            try:
                address = MulticastAddress(f"{GROUP_BASE}{FIRST + camera}", PORT, interface)
                yield camera, interface, MulticastReceiver(address)
            except (NetworkError, OSError):
                break  # the next one would fare no better
