"""How soon a network camera's faults and changes are seen, and what reading one costs.
Command: python tests/bench/bench_sources.py

Each fault 20 times: the time from when the camera begins it to when the source says so, then from the camera's return
to the next frame. Costs are processor time of the reading process, so that a busy machine does not spoil them.
"""

import contextlib
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.gst_camera import GstCamera, installed
from tests.support.mjpeg_camera import MjpegCamera
from tests.support.rtsp_camera import RtspCamera
from touchline.core.errors import Unavailable
from touchline.images.in_process import decode_in_process, read_in_process
from touchline.sources import SourceContext, source_from_url

AROUND = SourceContext(decode=decode_in_process, read=read_in_process, hosts=("127.0.0.1",))
ROUNDS = 20


def silence(kind: type, fault: str) -> list[tuple[float, float]]:
    """Seconds until seen, and from the return to a frame, of each round."""
    rounds = []
    with contextlib.closing(kind()) as camera:
        for _ in range(ROUNDS):
            with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
                source.read()
                if fault == "drop":
                    camera.drop()
                else:
                    setattr(camera, fault, True)
                start = time.monotonic()
                with contextlib.suppress(Unavailable):
                    while True:
                        source.read()
                seen = time.monotonic() - start
            if fault != "drop":
                setattr(camera, fault, False)
            camera.stalled = False
            start = time.monotonic()
            with contextlib.closing(source_from_url(camera.url, AROUND)) as source:
                source.read()
            rounds.append((seen, time.monotonic() - start))
    return rounds


def change(url: str, resize, rounds: int = 10) -> list[float]:
    """Seconds from the camera's change of size to the first frame that has it."""
    took = []
    with contextlib.closing(source_from_url(url, AROUND)) as source:
        source.read()
        for i in range(rounds):
            size = ((640, 480), (320, 240))[i % 2]
            resize(*size)
            start = time.monotonic()
            while tuple(source.read().size) != size:
                if time.monotonic() - start > 5:
                    return [float("nan")]
            took.append(time.monotonic() - start)
    return took


def cost(url: str, frames: int = 120) -> float:
    """Processor time a frame, ms, of this process."""
    with contextlib.closing(source_from_url(url, AROUND)) as source:
        for _ in range(10):
            source.read()
        start = time.process_time()
        for _ in range(frames):
            source.read()
        return 1000 * (time.process_time() - start) / frames


def main() -> None:
    for kind in (RtspCamera, MjpegCamera):
        for fault in ("stalled", "half", "trickle", "drop"):
            rounds = silence(kind, fault)
            seen, back = zip(*rounds, strict=True)
            say(kind.__name__, fault, f"seen {spread(seen)}, back {spread(back)}")
    for kind in (RtspCamera, MjpegCamera):
        with contextlib.closing(kind()) as camera:
            took = change(camera.url, lambda w, h, camera=camera: setattr(camera, "size", (w, h)))
            say(kind.__name__, "change of size", spread(took))
    if not installed():
        print("GStreamer's server is not installed: real codecs left out")
        return
    for codec in ("h264", "h265", "mjpeg"):
        with contextlib.closing(GstCamera(codec)) as camera:
            say(
                "GStreamer",
                codec,
                "change of size",
                spread(change(camera.url + "#open_s=10", camera.resize)),
            )
            if codec != "h265":  # whose encoder needs more than a small machine has
                camera.resize(1920, 1080)
                say(
                    "GStreamer",
                    codec,
                    f"1920 × 1080: {cost(camera.url + '#open_s=15'):.1f} ms of processor a frame",
                )


def spread(seconds: list[float]) -> str:
    return f"{statistics.median(seconds):.2f} s (worst {max(seconds):.2f})"


def say(*words: str) -> None:
    print(*words, flush=True)


if __name__ == "__main__":
    main()
