"""How honest the distortion told by rolling balls is: its error over its σ, for random lenses and rolls.

python tests/bench/bench_rolls.py        seeds 1, 2 and 3; 400 sets of two to twelve rolls each
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.rolling_balls import chords, lens_of  # noqa: E402
from touchline.core.geometry import ImageSize  # noqa: E402
from touchline.straight.rolls import analyse_rolls, border_pct  # noqa: E402

SIZE = ImageSize(1224, 1024)
SETS = 400


def main() -> None:
    for seed in (1, 2, 3):
        rng, off, told_sigma = np.random.default_rng(seed), [], []
        for _ in range(SETS):
            k = rng.uniform(-0.35, 0.15)
            told = analyse_rolls(*chords(rng, lens_of(k, SIZE), int(rng.integers(2, 13))), SIZE)
            off.append((told.border_pct - border_pct(k, SIZE)) / told.border_sigma_pct)
            told_sigma.append(told.border_sigma_pct)
        print(
            f"seed {seed}: {100 * np.mean(np.abs(off) < 2):.1f} % within 2 sigma, "
            f"rms {np.sqrt(np.mean(np.square(off))):.2f} sigma, "
            f"median sigma {np.median(told_sigma):.3f} % along the edge"
        )


if __name__ == "__main__":
    main()
