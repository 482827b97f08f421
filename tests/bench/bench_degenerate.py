"""Random degenerate clicks against every model: no hang, nothing non-finite, every refusal with its fix.

Command: python tests/bench/bench_degenerate.py [COUNT [FIRST SEED]]   (20 000 take about half an hour)
"""

import json
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.operator import FIELD, REGION, SIZE, reference_camera
from tests.support.sim_clicks import border_observations
from touchline.core.errors import TouchlineError
from touchline.core.records import Observation
from touchline.fitting import FITTERS
from touchline.models import MODELS, parameters_json

BORDERS = ("left", "right", "top", "bottom")
SLOW_S = 10.0


def few(rng):
    return {name: rng.uniform(0, 1000, (rng.integers(0, 5), 2)) for name in BORDERS}


def one_line(rng):
    start, along = rng.uniform(100, 500, 2), rng.uniform(-1, 1, 2)
    return {name: start + along * rng.uniform(0, 400, (9, 1)) for name in BORDERS}


def one_place(rng):
    return {
        name: rng.uniform(100, 900, 2) + rng.normal(0, 10.0 ** rng.integers(-12, 1), (9, 2))
        for name in BORDERS
    }


def random_places(rng):
    return {name: rng.uniform(0, [1280, 1024], (9, 2)) for name in BORDERS}


def mirrored(rng):
    return {o.feature: [1279, 0] + o.points * [-1, 1] for o in _seen(rng)}


def shuffled(rng):
    seen = _seen(rng)
    return {name: o.points for name, o in zip(rng.permutation(BORDERS), seen, strict=True)}


def parallel_only(rng):
    return {o.feature: o.points for o in _seen(rng)[:2]}


def steps(rng):
    return {o.feature: np.round(o.points / 100) * 100 for o in _seen(rng)}


def half_gone(rng):
    return {o.feature: o.points[: rng.integers(1, 9)] for o in _seen(rng)}


def noisy(rng):
    return {
        o.feature: np.clip(o.points + rng.normal(0, 60, o.points.shape), 0, 1000)
        for o in _seen(rng)
    }


def _seen(rng):
    camera = reference_camera(
        rng.choice(["none", "strong", "pincushion"]), float(rng.choice([0, 8]))
    )
    return border_observations(camera, REGION, 9, 0.3, rng, anywhere=True)


KINDS = (
    few,
    one_line,
    one_place,
    random_places,
    mirrored,
    shuffled,
    parallel_only,
    steps,
    half_gone,
    noisy,
)


def tried(rng, kind, model: str) -> str:
    """What came of one set: the refusal's reason, or "fitted"."""
    clicks = kind(rng)
    try:
        observations = tuple(Observation(name, "line", points) for name, points in clicks.items())
        fit = FITTERS[model].fit(observations, FIELD, REGION, SIZE)
    except TouchlineError as refusal:
        assert refusal.fix and refusal.reason
        return refusal.reason
    json.dumps(parameters_json(fit.model), allow_nan=False)  # a number that is none raises here
    MODELS[model].from_parameters(parameters_json(fit.model))
    assert fit.covariance is None or np.isfinite(fit.covariance).all()
    return "fitted"


def main(count: int, first: int = 0) -> None:
    outcomes, slowest = {kind.__name__: Counter() for kind in KINDS}, 0.0
    names = list(MODELS)
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        kind, model = KINDS[seed % len(KINDS)], names[(seed // len(KINDS)) % len(names)]
        start = time.process_time()
        try:
            outcomes[kind.__name__][tried(rng, kind, model)] += 1
        except Exception as error:
            raise AssertionError(f"seed {seed}: {kind.__name__} on {model}") from error
        slowest = max(slowest, time.process_time() - start)
        assert slowest < SLOW_S, f"seed {seed}: {kind.__name__} on {model} took {slowest:.1f} s"
    for kind, counts in outcomes.items():
        print(f"{kind:14} " + ", ".join(f"{reason} {n}" for reason, n in counts.most_common()))
    print(
        f"{count} sets, slowest {slowest:.2f} s, nothing hung, nothing was not finite, every refusal had a fix"
    )


if __name__ == "__main__":
    main(*(map(int, sys.argv[1:]) if len(sys.argv) > 1 else (20_000,)))
