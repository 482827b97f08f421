"""The geometry of two views from matches with mistakes, ours beside every robust estimator of OpenCV.

    .venv/bin/python tests/bench/bench_two_views.py

Real: the kusvod2 pairs, mean distance of the hand-clicked points from their epipolar lines (both views, root mean
square), once with these points among the matches, as the set has them, and once without. OpenCV at its own threshold
of 1 px, and the best of four thresholds picked afterwards. Simulated: medians of SEEDS pairs, clean points.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.pairs import KUSVOD2, PAIRS, epipolar_error_px, labelled_matches, simulated
from touchline.core.errors import FitFailed
from touchline.rigs.fundamental_matrix import fundamental_matrix

ESTIMATORS = (
    "RANSAC",
    "LMEDS",
    "USAC_DEFAULT",
    "USAC_ACCURATE",
    "USAC_FM_8PTS",
    "USAC_FAST",
    "USAC_PARALLEL",
    "USAC_MAGSAC",
)
THRESHOLDS_PX = (0.5, 1.0, 2.0, 3.0)
SEEDS = 12
OURS = "Touchline"
SUBSETS, SHARE = 24, 0.85


def by_opencv(name: str, a, b, threshold_px: float):
    found, _ = cv2.findFundamentalMat(a, b, getattr(cv2, name), threshold_px, 0.9999, 100_000)
    return None if found is None else found[:3]


def errors(a, b, to_a, to_b, threshold_px: float) -> dict[str, float]:
    found = {name: by_opencv(name, a, b, threshold_px) for name in ESTIMATORS}
    table = {
        name: float(epipolar_error_px(f, to_a, to_b).mean()) if f is not None else np.inf
        for name, f in found.items()
    }
    return {
        **table,
        OURS: float(epipolar_error_px(fundamental_matrix(a, b).fundamental, to_a, to_b).mean()),
    }


def real() -> None:
    for among in (True, False):
        print(
            f"\nkusvod2, px, hand-clicked points {'among' if among else 'kept out of'} the matches"
        )
        tables = []
        for name in PAIRS:
            a, b, by_hand, hand_a, hand_b = labelled_matches(name)
            keep = np.ones(len(a), bool) if among else ~by_hand
            tables.append([errors(a[keep], b[keep], hand_a, hand_b, t) for t in THRESHOLDS_PX])
        at_one = [of_pair[THRESHOLDS_PX.index(1.0)] for of_pair in tables]
        print(f"{'':16}" + "".join(f"{n:>10}" for n in (*PAIRS, "geo.mean")))
        for estimator in (*ESTIMATORS, OURS):
            row = [t[estimator] for t in at_one]
            print(
                f"{estimator:16}"
                + "".join(f"{v:10.3f}" for v in (*row, float(np.exp(np.mean(np.log(row))))))
            )
        for what, choice in (("best at 1 px", [[t] for t in at_one]), ("best afterwards", tables)):
            best = [min(t[e] for t in of_pair for e in ESTIMATORS) for of_pair in choice]
            ratio = [one[OURS] / v for one, v in zip(at_one, best, strict=True)]
            print(
                f"{what:16}"
                + "".join(f"{v:10.3f}" for v in best)
                + "   ours / it "
                + " ".join(f"{v:.2f}" for v in ratio)
            )
        means = {e: np.exp(np.mean([np.log(t[e]) for t in at_one])) for e in (*ESTIMATORS, OURS)}
        leader = min(ESTIMATORS, key=lambda e: means[e])
        print(
            f"over all pairs: ours {means[OURS]:.3f}, the best estimator, {leader}, {means[leader]:.3f}: "
            f"{means[OURS] / means[leader]:.2f} x (bar 1.2)"
        )


def subsets() -> None:
    """One run on one set of matches says little: medians over random shares of them."""
    compared = ("RANSAC", "LMEDS", "USAC_DEFAULT", "USAC_ACCURATE", "USAC_MAGSAC")
    print(
        f"\nkusvod2, px, medians over {SUBSETS} random {100 * SHARE:.0f} % of the matches, OpenCV at 1 px"
    )
    for among in (True, False):
        for name in PAIRS:
            a, b, by_hand, hand_a, hand_b = labelled_matches(name)
            keep = np.ones(len(a), bool) if among else ~by_hand
            a, b = a[keep], b[keep]
            rng = np.random.default_rng(0)
            rows: dict[str, list[float]] = {}
            for _ in range(SUBSETS):
                some = np.sort(rng.permutation(len(a))[: int(SHARE * len(a))])
                found = {one: by_opencv(one, a[some], b[some], 1.0) for one in compared}
                try:
                    found[OURS] = fundamental_matrix(a[some], b[some]).fundamental
                except FitFailed:
                    found[OURS] = None
                for one, f in found.items():
                    error = (
                        np.inf if f is None else float(epipolar_error_px(f, hand_a, hand_b).mean())
                    )
                    rows.setdefault(one, []).append(error)
            medians = {one: float(np.median(values)) for one, values in rows.items()}
            best = min(compared, key=medians.get)
            print(
                f"{name}, clicks {'among' if among else 'kept out of'} the matches: ours {medians[OURS]:.3f}, best "
                f"{best} {medians[best]:.3f}: {medians[OURS] / medians[best]:.2f} x, ours refused "
                f"{np.isinf(rows[OURS]).sum()} of {SUBSETS}"
            )


def simulations() -> None:
    print(
        f"\nsimulated, 120 matches, medians of {SEEDS} pairs, px on clean points (worst in brackets)"
    )
    for mistakes in (0.1, 0.4):
        for noise_px, uneven in ((0.3, False), (0.3, True)):
            rows: dict[str, list[float]] = {}
            seconds = []
            for seed in range(SEEDS):
                pair = simulated(seed, mistakes=mistakes, noise_px=noise_px, uneven=uneven)
                start = time.perf_counter()
                fundamental_matrix(pair.a, pair.b)
                seconds.append(time.perf_counter() - start)
                for name, value in errors(pair.a, pair.b, pair.clean_a, pair.clean_b, 1.0).items():
                    rows.setdefault(name, []).append(value)
            print(
                f"{100 * mistakes:.0f} % mistakes, σ {noise_px} px{', uneven' if uneven else ''} "
                f"({np.median(seconds):.2f} s): "
                + ", ".join(f"{n} {np.median(v):.3f} ({max(v):.2f})" for n, v in rows.items())
            )


def degenerate() -> None:
    """What each says of matches that determine nothing: finite answers are wrong ones."""
    print("\nmatches that determine nothing")
    rng = np.random.default_rng(0)
    flat = simulated(1, flat=True, mistakes=0.1)
    random = [rng.uniform([0, 0], [1280, 1024], (60, 2)) for _ in range(2)]
    line = np.stack([np.linspace(0, 1000, 30), np.linspace(100, 600, 30)], axis=1)
    for what, a, b in (
        ("all on the carpet", flat.a, flat.b),
        ("at random", *random),
        ("on one line", line, line + 5),
    ):
        answers = [name for name in ESTIMATORS if by_opencv(name, a, b, 1.0) is not None]
        try:
            fundamental_matrix(a, b)
            ours = "an answer"
        except FitFailed as refusal:
            ours = f"refused, {refusal.reason}"
        print(
            f"{what}: OpenCV answers with {len(answers)} of {len(ESTIMATORS)} estimators; ours: {ours}"
        )


def main() -> None:
    if KUSVOD2.is_dir():
        real()
        subsets()
    else:
        print("The kusvod2 pairs are not beside the project; only simulated ones are measured.")
    simulations()
    degenerate()


if __name__ == "__main__":
    main()
