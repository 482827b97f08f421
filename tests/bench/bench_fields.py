"""How well is a field found as it is: by tape, by what a calibration found of its lines, and from a picture?

Run: python tests/bench/bench_fields.py [pictures]. Lines of Division B lie 15 mm off; tapes err by 1 mm and clicks by
0.3 px. The pictures are the second simulator's, each calibrated without clicks, over a field of borders alone.
"""

import sys
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.second_simulator import render, scene_spec  # noqa: E402
from tests.support.tape import SIDES_AND_DIAGONALS, measured  # noqa: E402
from tests.support.taped_field import bare, calibrated_on, visible, worst_mm  # noqa: E402
from touchline.automatic.request import AutomaticRequest  # noqa: E402
from touchline.core.field_json import field_from_json  # noqa: E402
from touchline.core.records import Frame  # noqa: E402
from touchline.fields.measuring import (  # noqa: E402
    JoinedField,
    TapeDistance,
    adjust_to_tape,
    as_found,
)
from touchline.fields.seen_markings import seen_field  # noqa: E402
from touchline.store.fields import load_fields  # noqa: E402

FIELD = load_fields()["ssl-div-b"]
LINES = ("goal-line-right", "touch-line-top", "halfway-line")
NEAR_MM = 25.0


def by_tape() -> None:
    off, took = [], []
    for name, seed in product(LINES, range(20)):
        truth = JoinedField(FIELD).moved({name: (15.0, 15.0)}, {})
        distances = [
            TapeDistance(*one)
            for one in measured(truth, SIDES_AND_DIAGONALS, noise_mm=1.0, seed=seed)
        ]
        begun = time.thread_time()
        found = adjust_to_tape(FIELD, distances)
        took.append(time.thread_time() - begun)
        off.append(worst_mm(found.field, truth))
    print(
        f"13 tape distances, {len(off)} fields: the worst end of any line {np.median(off):.1f} mm off (median), "
        f"{max(off):.1f} at most; {1000 * np.median(took):.0f} ms"
    )


def by_calibration() -> None:
    for name in LINES:
        off, sigmas = [], []
        for aside, seed in product((15.0, -15.0), range(6)):
            truth = JoinedField(FIELD).moved({name: (aside, aside)}, {})
            found = as_found(calibrated_on(FIELD, truth, seed), FIELD)
            off.append(worst_mm(found.field, truth))
            sigmas.append(abs(found.offsets[name][0] - aside) / found.offsets[name][1])
        print(
            f"a calibration's offsets, {name}, {len(off)} cameras: {np.median(off):.1f} mm (median), {max(off):.1f} "
            f"at most, {sum(one > 3 for one in off)} over 3; {max(sigmas):.1f} of its σ at most"
        )


def from_pictures(count: int) -> None:
    seen = there = wrong = looked = 0
    took = []
    for seed in range(count):
        shown = render(scene_spec(seed))
        _, made = AutomaticRequest(shown.field, shown.region, "brown-conrady").answer(
            Frame(shown.pixels)
        )
        if made is None:
            continue
        begun = time.thread_time()
        told = seen_field(shown.pixels, made, bare(shown.field))
        took.append(time.thread_time() - begun)
        looked += 1
        field = field_from_json(told["field"])
        added = [(field.lines | field.arcs)[name] for name in told["added"]]
        for marking in replace(
            shown.field,
            lines={n: m for n, m in shown.field.lines.items() if n not in bare(shown.field).lines},
        ).markings:
            places = visible(shown, marking)
            if len(places) >= 15:
                there += 1
                off = [np.linalg.norm(one.nearest(places) - places, axis=1) for one in added]
                seen += bool(off) and float(np.mean(np.min(off, axis=0) < NEAR_MM)) > 0.6
        wrong += sum(
            min(
                float(np.linalg.norm(m.nearest(one.sample(20)) - one.sample(20), axis=1).mean())
                for m in shown.field.markings
            )
            > NEAR_MM
            for one in added
        )
    print(
        f"{looked} of {count} pictures calibrated: {seen} of {there} markings in sight added, {wrong} that are none; "
        f"{np.median(took):.2f} s"
    )


if __name__ == "__main__":
    by_tape()
    by_calibration()
    from_pictures(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
