"""What the simulated camera, the look at light and focus, and the background cost, and what they are worth.

Command: python tests/bench/bench_sim_and_light.py     (a minute; processor time of one core, OpenCV on one thread)
"""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.line_centres import centroids, clear_of_others
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim.render import Rendering
from touchline.store.fields import load_fields
from touchline.vision.background import Background
from touchline.vision.flicker import measure_flicker, row_means
from touchline.vision.light import measure_light
from touchline.vision.sharpness import measure_sharpness

FIELDS = load_fields()


def rendering(url: str) -> Rendering:
    return source_from_url(f"sim://ssl-div-b?{url}", SourceContext(FIELDS)).rendering


def median_ms(work: Callable[[int], object], rounds: int = 60) -> float:
    times = []
    for i in range(rounds):
        start = time.process_time()
        work(i)
        times.append(time.process_time() - start)
    return float(np.median(times) * 1e3)


def simulated() -> None:
    for url in (
        "robots=0",
        "robots=8",
        "robots=16",
        "robots=8&people=2",
        "robots=8&flicker=0.1&drift=0.2",
    ):
        start = time.process_time()
        shown = rendering(f"size=1920x1080&{url}")
        shown.frame(0)
        built = time.process_time() - start
        cost = median_ms(lambda i, shown=shown: shown.frame(i, 30))
        print(
            f"1920 × 1080, {url}: {cost:.1f} ms a frame, {3 * cost:.0f} % of a core at 30 fps; "
            f"{built:.1f} s before the first"
        )


def looks() -> None:
    full = rendering("size=1920x1080&robots=8").frame(0)
    small = cv2.resize(full, (640, 360), interpolation=cv2.INTER_AREA)
    light, focus, full_focus = (
        median_ms(lambda _, f=f: f())
        for f in (
            lambda: measure_light(small),
            lambda: measure_sharpness(small),
            lambda: measure_sharpness(full),
        )
    )
    print(
        f"640 × 360: light {light:.1f} ms, sharpness {focus:.1f} ms; sharpness of 1920 × 1080 {full_focus:.1f} ms"
    )
    rows = [row_means(rendering("size=640x360&flicker=0.1").frame(i, 30)) for i in range(30)]
    print(
        f"row means of 1920 × 1080 {median_ms(lambda _: row_means(full)):.2f} ms, flicker of 30 frames "
        f"{median_ms(lambda _: measure_flicker(np.arange(30) / 30, rows), 15):.1f} ms"
    )


def most_memory_mb() -> float:
    """Of this process so far. The kernel's other counter begins with its parent's."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024


def background(count: int) -> None:
    """In a process of its own, whose memory before and after can be told apart."""
    frames = [
        np.random.default_rng(0).integers(0, 256, (1080, 1920, 3), np.uint8) for _ in range(2)
    ]
    before = most_memory_mb()
    start, cpu = time.perf_counter(), time.process_time()
    found = Background(frames[0].shape, count)
    for i in range(count):
        found.add(frames[i % 2])
    _ = found.picture
    print(
        f"background of {count} frames of 1920 × 1080: {time.perf_counter() - start:.2f} s "
        f"({time.process_time() - cpu:.2f} s of one core), "
        f"{most_memory_mb() - before:.0f} MB"
    )


def line_centres() -> None:
    field = FIELDS["ssl-div-b"]
    for noise in (2, 4, 8):
        error = {1: [], 5: [], 15: []}
        for seed in (1, 2, 3):
            exact = rendering(f"size=1280x960&robots=0&noise=0&seed={seed}")
            crowded = rendering(f"size=1280x960&robots=8&people=3&noise={noise}&seed={seed}")
            true = exact.frame(0)[..., 1]
            for count, errors in error.items():
                found = Background((*true.shape, 3), count)
                for i in range(count):
                    found.add(crowded.frame_at(i, 10 * i / count))
                for line in field.lines.values():
                    clear = clear_of_others(field, line, 60)
                    off = [
                        centroids(pixels, exact.camera, line, 60)[clear]
                        for pixels in (found.picture[..., 1], true)
                    ]
                    errors.append(np.clip(np.abs(off[0] - off[1]), 0, 6))
        said = ", ".join(
            f"{count}: {np.sqrt(np.mean(np.concatenate(e) ** 2)):.3f} px rms, "
            f"{np.median(np.concatenate(e)):.3f} median"
            for count, e in error.items()
        )
        print(f"line centres with 8 robots, 3 people, noise {noise}, by frames: {said}")


if __name__ == "__main__":
    cv2.setNumThreads(1)
    if len(sys.argv) == 2:
        background(int(sys.argv[1]))
    else:
        simulated()
        looks()
        for count in (15, 25):
            subprocess.run([sys.executable, __file__, str(count)], check=True)
        line_centres()
