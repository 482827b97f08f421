"""Industrial cameras: what a hundred openings leave behind, how fast frames come, how long finding takes.

python tests/bench/bench_industrial.py
"""

import sys
import time
from contextlib import closing
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.industrial import GvCamera, held, opened  # noqa: E402
from touchline.sources.discover import discover_cameras  # noqa: E402
from touchline.sources.industrial.camera import PIXEL_FORMATS, bgr_from_raw  # noqa: E402

CYCLES = 100
FAKE, WIRE = "aravis://Fake_1?fps=200", "aravis://127.0.0.1?fps=100"


def memory_mb() -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS"))


def cycles(url: str) -> None:
    def once() -> None:
        with closing(opened(url)) as camera:
            camera.read()

    for _ in range(CYCLES):  # allocators and libraries settle
        once()
    before, before_mb, start = held(), memory_mb(), time.perf_counter()
    for _ in range(CYCLES):
        once()
    took_ms = (time.perf_counter() - start) / CYCLES * 1000
    print(
        f"{url}: {CYCLES} times opened, one frame, closed: {before} before, {held()} after, "
        f"{memory_mb() - before_mb:+.1f} MB, {took_ms:.0f} ms each"
    )


def rate(url: str, fps: float, **size: int) -> None:
    with closing(opened(url)) as camera:
        for name, value in (*size.items(), ("frame_rate", fps)):
            camera.set_control(name, value)
        for _ in range(150):
            camera.read()
        start, count, lost = time.perf_counter(), int(5 * fps), camera._device.incomplete
        used = time.process_time()
        for _ in range(count):
            shape = camera.read().pixels.shape
        seconds, lost_now = time.perf_counter() - start, camera._device.incomplete
        print(
            f"{url}: {shape[1]}x{shape[0]} asked at {fps:g} Hz, came at {count / seconds:.1f}, "
            f"{lost_now - lost} incomplete, {(time.process_time() - used) / seconds:.0%} of a processor"
        )
        if "127.0.0.1" in url:
            for name in ("width", "height"):
                camera.set_control(name, 256)


def conversion() -> None:
    for name in ("BayerRG8", "YUV422_8", "RGB8", "Mono8"):
        raw = bytes(1920 * 1080 * PIXEL_FORMATS[name].bytes_per_pixel)
        times = []
        for _ in range(30):
            start = time.perf_counter()
            bgr_from_raw(raw, 1920, 1080, PIXEL_FORMATS[name].code)
            times.append(time.perf_counter() - start)
        print(f"{name} 1920x1080 to BGR: {sorted(times)[15] * 1000:.1f} ms")


def main() -> None:
    conversion()
    for _ in range(3):
        start = time.perf_counter()
        cameras = discover_cameras()
        print(f"finding: {len(cameras)} cameras in {time.perf_counter() - start:.1f} s")
    rate(FAKE, 30, width=1920, height=1080)
    cycles(FAKE)
    with closing(GvCamera()):
        rate(WIRE, 100)
        rate(WIRE, 30, width=1280, height=1024)
        cycles(WIRE)


if __name__ == "__main__":
    main()
