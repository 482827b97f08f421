"""Speed of the correction against OpenCV in the same run. Command: python -m pytest tests/bench/bench_correction.py

Ratios count; milliseconds are this machine's.
"""

from dataclasses import replace
from functools import partial

import cv2
import numpy as np
import pytest

from tests.support.examples import plain_examples
from touchline.imaging.correction import CorrectedView, correction_map

FULL_HD = replace(plain_examples("polynomial")[0], width_px=1919.0, height_px=1079.0)
PICTURE = np.random.default_rng(0).integers(0, 255, (580, 780, 3), np.uint8)


def median_ms(work, rounds: int = 31) -> float:
    import time

    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times) * 1e3)


def paired_ratio(ours, peer, rounds: int = 41) -> float:
    """Median of ratios of runs side by side, so that a machine that slows down slows both."""
    import time

    ratios = []
    for _ in range(rounds):
        a = time.perf_counter()
        ours()
        b = time.perf_counter()
        peer()
        ratios.append((b - a) / (time.perf_counter() - b))
    return float(np.median(ratios))


def two_pass_maps(model):
    x_c, y = np.meshgrid(
        np.arange(model.corrected_size.width, dtype=float),
        np.arange(1080, dtype=float) * 580 / 1080,
    )
    x = model.left(y) + x_c * (model.right(y) - model.left(y)) / model.width_px
    _, y_c = np.meshgrid(
        np.arange(model.corrected_size.width, dtype=float),
        np.arange(model.corrected_size.height, dtype=float),
    )
    y2 = model.top(x_c) + y_c * (model.bottom(x_c) - model.top(x_c)) / model.height_px
    return [
        cv2.convertMaps(a.astype(np.float32), b.astype(np.float32), cv2.CV_16SC2)
        for a, b in ((x, y), (x_c, y2 * 1080 / 580))
    ]


def test_building_the_map_for_1080p(benchmark):
    benchmark(correction_map, FULL_HD)
    assert median_ms(partial(correction_map, FULL_HD)) <= 60


def test_building_the_map_for_a_watched_width(benchmark):
    benchmark(correction_map, FULL_HD, CorrectedView(width=960))


def test_applying_the_map_is_remap_alone(benchmark):
    table = correction_map(FULL_HD)
    fixed = cv2.convertMaps(
        np.nan_to_num(table.raw_x, nan=-1e4), np.nan_to_num(table.raw_y, nan=-1e4), cv2.CV_16SC2
    )
    benchmark(table.apply, PICTURE)
    ratio = paired_ratio(
        lambda: table.apply(PICTURE), lambda: cv2.remap(PICTURE, *fixed, cv2.INTER_LINEAR)
    )
    print(f"\napplying our map / cv2.remap with fixed maps: {ratio:.3f}")
    assert ratio <= 1.05


def test_one_pass_against_two():
    """Both with fixed-point maps made beforehand, 1080p out."""
    table, (first, second) = correction_map(FULL_HD), two_pass_maps(FULL_HD)

    def two():
        rows_done = cv2.remap(PICTURE, *first, cv2.INTER_LINEAR)
        return cv2.remap(rows_done, *second, cv2.INTER_LINEAR)

    ratio = paired_ratio(two, lambda: table.apply(PICTURE))
    print(f"\ntwo passes / one pass: {ratio:.2f}")
    assert ratio >= 1.8


if __name__ == "__main__":
    pytest.main([__file__, "-q", "-s"])
