"""Boards: error of the lens and time, beside OpenCV and mrcal. Command: python -m pytest -s tests/bench/bench_boards.py

The world is tests/support/board_views.py: 10 × 10 corners 100 mm apart, the middle 1 mm above two edges, 0.2 px noise,
all corners inside 1280 × 1024 px, lens k1 -0.28, k2 0.09. The error is the median over the picture of the distance
between two lenses' pixels for one ray, the best rotation taken out. mrcal's time holds the start of its command.
"""

import time

import numpy as np
import pytest

from tests.support.bench_peers import mrcal, opencv
from tests.support.board_views import (
    BOARD,
    PLAIN,
    SIZE,
    TRUTH,
    median_difference,
    views_of,
    walked,
    zoomed_views,
)
from touchline.boards.fit import fit_board
from touchline.boards.uncertainty import FocalDrift, expected_px, lens_sensitivity
from touchline.models import MODELS
from touchline.models.intrinsics import lens_difference

BROWN = MODELS["brown-conrady"]
SEEDS = range(8)


@pytest.mark.parametrize(
    "count, limit_px, strays", [(40, 0.042, 0.0), (12, 0.13, 0.0), (40, 0.06, 0.01)]
)
def test_true_error_of_the_lens(count, limit_px, strays):
    """The limits are mrcal's published figures; where it is installed, ours is also held to its on the same corners."""
    ours, theirs, cv = [], [], []
    for seed in SEEDS:
        views = views_of(count=count, seed=seed, stray_share=strays)
        ours.append(median_difference(TRUTH, fit_board(views, SIZE, BROWN).lens))
        cv.append(median_difference(TRUTH, opencv(views, SIZE)[0]))
        peer = mrcal(views, BOARD, SIZE, TRUTH.focal_px)
        if peer:
            theirs.append(median_difference(TRUTH, peer[0]))
    told = f"{np.median(theirs):.4f}" if theirs else "absent"
    print(
        f"\n{count} views, {strays:.0%} strays, median of 8 seeds: ours {np.median(ours):.4f} px, mrcal {told}, "
        f"OpenCV {np.median(cv):.3f}; ours by seed {np.round(ours, 4).tolist()}"
    )
    assert np.median(ours) <= limit_px
    if theirs:
        assert np.median(ours) <= 1.02 * np.median(theirs)


def test_three_hundred_views_are_quick():
    views = views_of(count=300)
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        fit = fit_board(views, SIZE, BROWN)
        seconds.append(time.perf_counter() - start)
    start = time.perf_counter()
    fit_board(views, SIZE, BROWN, {"terms": list(PLAIN)})
    given = time.perf_counter() - start
    peer = mrcal(views, BOARD, SIZE, TRUTH.focal_px)
    told = f"{peer[1]:.2f} s" if peer else "absent"
    print(
        f"\n300 views, 30,000 corners: ours {np.median(seconds):.2f} s with terms chosen, {given:.2f} s with terms "
        f"given, mrcal {told}; error {median_difference(TRUTH, fit.lens):.4f} px"
    )
    assert np.median(seconds) <= 3.0


def test_opencv_on_a_hundred_views():
    views = views_of(count=100)
    _, rms, seconds = opencv(views, SIZE)
    start = time.perf_counter()
    fit = fit_board(views, SIZE, BROWN, {"terms": list(PLAIN)})
    print(
        f"\n100 views: ours {time.perf_counter() - start:.2f} s, rms {fit.rms_px:.3f}; OpenCV {seconds:.2f} s, "
        f"rms {rms:.3f}"
    )


def test_predicted_sigma_is_the_sampled_one_within_a_tenth():
    """200 seeds of 12 views; root mean squares at 48 places of the picture."""
    pixels = np.stack(np.meshgrid(np.linspace(100, 1180, 8), np.linspace(80, 944, 6)), -1).reshape(
        -1, 2
    )
    seen, told = [], []
    for seed in range(200):
        lens = fit_board(views_of(count=12, seed=seed), SIZE, BROWN, {"terms": list(PLAIN)}).lens
        seen.append(np.sum(lens_difference(TRUTH, lens, pixels) ** 2, axis=-1))
        told.append(
            expected_px(lens_sensitivity(lens, lens.estimated, pixels), np.array(lens.covariance))
            ** 2
        )
    ratio = np.sqrt(np.mean(seen, axis=0) / np.mean(told, axis=0))
    print(
        f"\nsampled / predicted over the picture, 200 seeds: median {np.median(ratio):.3f}, "
        f"{ratio.min():.3f} to {ratio.max():.3f}"
    )
    assert np.median(ratio) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    "growth, jumps, told_at_least",
    [(0.03, False, 16), (0.03, True, 16), (0.01, False, 15), (0.01, True, 15), (0.005, False, 0)],
)
def test_a_zoom_that_moves_through_the_views(growth, jumps, told_at_least):
    """16 series: 8 seeds of 12 and of 20 views; the focal length creeps evenly, or jumps in the middle."""
    drifts = []
    for count in (12, 20):
        shares = np.linspace(0, 1, count).round() if jumps else np.linspace(0, 1, count)
        drifts += [
            FocalDrift.of(fit_board(zoomed_views(growth * shares, seed=seed), SIZE, BROWN))
            for seed in SEEDS
        ]
    told = sum(drift.significant for drift in drifts)
    least = min(abs(drift.change) / drift.sigma for drift in drifts)
    print(
        f"\nzoom {growth:.1%} {'at once' if jumps else 'evenly'}: told in {told} of 16, from {least:.1f} sigmas"
    )
    assert told >= told_at_least


def test_honest_series_in_any_order_show_no_zoom():
    """8 seeds of 8, 12, 20 and 40 views; as taken, and as an operator takes them who walks in four ways."""
    drifts = []
    for count in (8, 12, 20, 40):
        for seed in SEEDS:
            views = views_of(count=count, seed=seed)
            orders = [
                views,
                *(walked(views, how) for how in ("across", "down", "away", "outwards")),
            ]
            drifts += [FocalDrift.of(fit_board(order, SIZE, BROWN)) for order in orders]
    most = max(abs(drift.change) / drift.sigma for drift in drifts)
    print(
        f"\n{len(drifts)} honest series: {sum(d.significant for d in drifts)} doubted; at most {most:.1f} sigmas, "
        f"{100 * max(abs(drift.change) for drift in drifts):.2f} %"
    )
    assert not any(drift.significant for drift in drifts)
