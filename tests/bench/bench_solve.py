"""Our Levenberg–Marquardt against scipy's on the same camera fits. Command: python tests/bench/bench_solve.py

Needs scipy (pip install scipy); it is no dependency. Same residuals, same derivatives, same starts, and what scipy asks
for twice at one place is computed once; ratios of time side by side, and how often each ends at the best minimum.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.operator import FIELD, REGION, reference_camera, true_camera
from tests.support.sim_clicks import border_observations
from touchline.fitting.least_squares import minimise
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.ray_camera.problem import gather_clicks

HELD = {"aspect", "centre_x", "centre_y", "p1", "p2", "k3", "k4", "k5", "k6"}


def one(seed: int, tilt: int) -> dict[str, tuple[float, float, int]]:
    """Cost, seconds and looks of each solver from the same poor start."""
    rng = np.random.default_rng(seed)
    camera = reference_camera("strong", tilt)
    clicks = border_observations(camera, REGION, 9, 0.3, rng, anywhere=True)
    truth = RayCameraParameters.of(true_camera(camera))
    free = np.array([name not in HELD for name in truth.names])
    poor = replace(
        truth,
        terms=truth.terms * 0,
        log_focal=truth.log_focal + rng.normal(0, 0.15),
        position_mm=truth.position_mm + rng.normal(0, 150, 3),
    ).retract(np.concatenate([np.zeros(3), rng.normal(0, 0.03, 3), np.zeros(3)]), free)
    found = {}
    for name in ("ours", "scipy lm", "scipy trf"):
        problem = gather_clicks(clicks, FIELD, REGION, with_offsets=False)
        looks = 0

        def evaluate(state, problem=problem):
            nonlocal looks
            looks += 1
            r, j = problem.residuals(state)
            height = (state.position_mm[2] - camera.position_mm[2]) / 30.0
            row = np.zeros((1, j.shape[1]))
            row[0, state.names.index("height")] = 1 / 30.0
            return np.append(r / 0.3, height), np.concatenate([j / 0.3, row])[:, free]

        start = time.perf_counter()
        if name == "ours":
            cost = minimise(poor, evaluate, lambda s, d: s.retract(d, free), tolerance=1e-8).cost
        else:
            last: dict[bytes, tuple] = {}

            def at(d, last=last, evaluate=evaluate):
                if d.tobytes() not in last:
                    last.clear()
                    last[d.tobytes()] = evaluate(poor.retract(d, free))
                return last[d.tobytes()]

            answer = least_squares(
                lambda d, at=at: at(d)[0],
                np.zeros(int(free.sum())),
                jac=lambda d, at=at: at(d)[1],
                method=name.split()[1],
                x_scale="jac",
                xtol=1e-10,
                ftol=1e-10,
                gtol=1e-10,
            )
            cost = 2 * answer.cost
        found[name] = (cost, time.perf_counter() - start, looks)
    return found


if __name__ == "__main__":
    results = [one(seed, tilt) for tilt in (0, 8, 15) for seed in range(8)]
    best = [min(r[0] for r in result.values()) for result in results]
    for name in results[0]:
        at_best = sum(
            result[name][0] <= b * 1.001 + 1e-6 for result, b in zip(results, best, strict=True)
        )
        ratio = np.median([result[name][1] / result["ours"][1] for result in results])
        print(
            f"{name:10} best minimum {at_best} of {len(results)}, time / ours {ratio:.2f}, "
            f"median looks {np.median([result[name][2] for result in results]):.0f}"
        )
