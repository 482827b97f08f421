"""What sends H.264 over UDP, as vision-processor's rtpstreamer.cpp does it: libx264 and FFmpeg's own muxers."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from itertools import count

import av
import numpy as np
from av.container import OutputContainer

Pictures = Callable[[int], np.ndarray]  # the n-th picture: BGR, or its Y alone where it is grey
STREAMS = {"rtp": "rtp", "mpegts": "udp", "h264": "udp"}


def carpet(n: int, width: int = 320, height: int = 240) -> np.ndarray:
    """A green carpet with white lines and a ball whose place tells n."""
    picture = np.empty((height, width, 3), np.uint8)
    picture[:] = (60, 120, 40)
    picture[:: height // 3] = picture[:, :: width // 4] = 240
    picture[height // 3 :][:8, 8 * (n % (width // 8)) :][:, :8] = (0, 128, 255)
    return picture


def computed_views(bgr: np.ndarray) -> dict[str, np.ndarray]:
    """The views of vision-processor, by its kernels' formulas: flat as BGR, gradient and blobs as Y."""
    noise = np.random.default_rng(0).normal(0, 2, bgr.shape)
    whole = np.clip(bgr + noise, 0, 255).astype(int)
    flat = (3 * whole - whole.sum(2, keepdims=True) + 510) // 4
    padded = np.pad(flat, ((2, 2), (2, 2), (0, 0)), "edge")
    products = (padded[2:-2, 4:] - padded[2:-2, :-4]) * (padded[4:, 2:-2] - padded[:-4, 2:-2])
    gradient = products.sum(2)
    r = 4
    sums = np.pad(gradient, r, "edge").cumsum(0).cumsum(1)
    boxes = (sums[r:, r:] - sums[:-r, r:] - sums[r:, :-r] + sums[:-r, :-r]) / r**2
    (h, w), corners = gradient.shape, []
    for y in (0, r):
        for x in (0, r):
            corners.append((1 if x == y else -1) * boxes[y : y + h, x : x + w])
    blobs = np.min(corners, axis=0)
    return {
        "flat": flat.astype(np.uint8),
        "gradient": np.clip(gradient + 127, 0, 255).astype(np.uint8),
        "blobs": np.clip(blobs + 127, 0, 255).astype(np.uint8),
    }


class H264Sender:
    """Sends until close(): a picture every 1/fps s, a key frame every gop, anew where the size of pictures changes.

    pictures: may be set while it runs. keys, sent: so many key frames and pictures so far.
    """

    def __init__(
        self,
        url: str,
        pictures: Pictures = carpet,
        fps: float = 30,
        gop: int = 30,
        form: str = "rtp",
    ) -> None:
        self.url, self.pictures, self.fps, self.gop, self.form = url, pictures, fps, gop, form
        self.keys = self.sent = 0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._end.set()
        self._thread.join(30)

    def _run(self) -> None:
        output: OutputContainer | None = None
        size, begun = None, time.monotonic()
        for n in count():
            picture = self.pictures(n)
            if output is None or picture.shape[:2] != size:
                if output is not None:
                    output.close()
                output, size = av.open(self.url, "w", format=self.form), picture.shape[:2]
                stream = output.add_stream("libx264", rate=round(self.fps))
                stream.height, stream.width = size
                stream.pix_fmt, stream.bit_rate, stream.gop_size = "nv12", 3_500_000, self.gop
                stream.max_b_frames = 0
                stream.options = {"preset": "ultrafast", "tune": "zerolatency"}
            frame = frame_from(picture)
            frame.pts = n
            for packet in stream.encode(frame):
                self.keys += packet.is_keyframe
                output.mux(packet)
            self.sent += 1
            if self._end.wait(max(0.0, begun + (n + 1) / self.fps - time.monotonic())):
                output.close()
                return


def frame_from(picture: np.ndarray) -> av.VideoFrame:
    """A picture as NV12, as vision-processor makes it: of a grey one both colour differences are 127."""
    if picture.ndim == 3:
        return av.VideoFrame.from_ndarray(picture, "bgr24").reformat(format="nv12")
    height, width = picture.shape
    colours = np.full((height // 2, width), 127, np.uint8)
    return av.VideoFrame.from_ndarray(np.vstack((picture, colours)), "nv12")


class LossyRelay:
    """Passes on what arrives at its port, through change(); what that returns is sent."""

    def __init__(
        self,
        to: tuple[str, int],
        change: Callable[[bytes], list[bytes]] = lambda data: [data],
        address: str = "127.0.0.1",
    ) -> None:
        self.change = change
        self._line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._line.bind(("127.0.0.1", 0))
        self._line.settimeout(0.1)
        self._out, self._to = loopback_socket(address), to
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        return f"rtp://127.0.0.1:{self._line.getsockname()[1]}"

    def close(self) -> None:
        self._end.set()
        self._thread.join(30)
        self._line.close()
        self._out.close()

    def _run(self) -> None:
        while not self._end.is_set():
            with contextlib.suppress(TimeoutError):
                for packet in self.change(self._line.recv(65536)):
                    self._out.sendto(packet, self._to)


def loopback_socket(address: str = "127.0.0.1") -> socket.socket:
    """A socket whose packets to groups stay on this machine, and come from that address of it."""
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    line.bind((address, 0))
    return line


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


def packets_of(pictures: Pictures, number: int, gop: int = 30, form: str = "rtp") -> list[bytes]:
    """The datagrams of so many pictures, as a sender sends them."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        line.bind(("127.0.0.1", 0))
        line.settimeout(0.1)
        url = f"{STREAMS[form]}://127.0.0.1:{line.getsockname()[1]}?pkt_size=1316"
        found = []
        with contextlib.closing(H264Sender(url, pictures, 200, gop, form)) as sender:
            while sender.sent < number:
                found += _received(line, 1)
        return found + _received(line, 1_000_000)


def _received(line: socket.socket, number: int) -> list[bytes]:
    """The next datagrams, fewer where there is a pause."""
    found: list[bytes] = []
    with contextlib.suppress(TimeoutError):
        while len(found) < number:
            found.append(line.recv(65536))
    return found


def free_group() -> tuple[str, int]:
    port = free_port()
    return f"239.255.77.{1 + port % 250}", port


@contextlib.contextmanager
def sent_to_group(form: str = "rtp", **how) -> Iterator[tuple[str, H264Sender]]:
    """A sender to a group on this machine's loopback alone: the address to open, and the sender."""
    group, port = free_group()
    to = f"{STREAMS[form]}://{group}:{port}"
    with contextlib.closing(
        H264Sender(f"{to}?localaddr=127.0.0.1&pkt_size=1316&ttl=0", form=form, **how)
    ) as sender:
        yield f"{to}?interface=127.0.0.1", sender
