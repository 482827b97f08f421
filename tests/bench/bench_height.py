"""A camera height that is off, against the points. Command: python tests/bench/bench_height.py [SEEDS [FIRST SEED]]

Four kinds of view, points as clicked and as detected (tests/support/height_scenes.py), the height by tape (σ 30 mm) and
off by shares of it: how often it is called contradicted, agreeing and not checked, the levels, and the error at robot
tops as it is and as it is told.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.height_scenes import POINTS, VIEWS, HeightScene, height_scene
from touchline.core.errors import TouchlineError
from touchline.workflows.calibration import calibrate

OFF = (0.0, 0.02, -0.05, 0.1, -0.2, 0.4)
TAPE_MM = 30.0


def judged(
    scene: HeightScene, off: float, rng: np.random.Generator
) -> tuple[str, str, float, float] | None:
    """Return state, level, and the error at robot tops, true and told, mm; None where the fit is refused."""
    try:
        done = calibrate(
            scene.observations,
            scene.field,
            scene.region,
            scene.image_size,
            scene.model,
            scene.height_option(1 + off, rng.normal(0, TAPE_MM), TAPE_MM),
            cross_validate=False,
        )
    except TouchlineError:
        return None
    return (
        done.report["height"]["state"],
        done.report["verdict"]["level"],
        scene.error_mm(done.model, scene.field.hat_height_mm),
        done.report["sigma_mm"]["hat"]["rms"],
    )


def test_a_contradicted_height_is_never_good_and_its_error_is_told():
    for seed in range(2):
        for view in VIEWS:
            found = judged(height_scene(seed, view, "detected"), -0.2, np.random.default_rng(seed))
            assert found is not None
            state, level, true_mm, told_mm = found
            assert (level == "poor") == (state == "contradicted")
            assert state == "not-checked" or told_mm > true_mm / 3


def main(seeds: int, first: int) -> None:
    print(
        "| view | points | off | refused | contradicted | agrees | not checked | good | tops, true | told | most "
        "true over told, where checked |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )
    for view in VIEWS:
        for points in POINTS:
            scenes = {
                seed: height_scene(seed, view, points) for seed in range(first, first + seeds)
            }
            for off in OFF:
                found = [
                    judged(scene, off, np.random.default_rng(seed))
                    for seed, scene in scenes.items()
                ]
                rows = [row for row in found if row is not None]
                states = Counter(row[0] for row in rows)
                true, told = np.array([row[2:] for row in rows]).T
                checked = [row[2] / row[3] for row in rows if row[0] != "not-checked"]
                print(
                    f"| {view} | {points} | {off:+.0%} | {len(found) - len(rows)} | {states['contradicted']} | "
                    f"{states['agrees']} | {states['not-checked']} | {sum(row[1] == 'good' for row in rows)} | "
                    f"{np.median(true):.1f} mm | {np.median(told):.1f} mm | "
                    f"{max(checked, default=float('nan')):.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main(
        *(map(int, sys.argv[1:]) if len(sys.argv) > 1 else (25,)),
        *([0] if len(sys.argv) < 3 else []),
    )
