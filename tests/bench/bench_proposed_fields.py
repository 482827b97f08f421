"""Fields that nobody has described, proposed from one picture.

Command: python tests/bench/bench_proposed_fields.py KIND …

scenes FROM TO: those of the second simulator that show a whole field, by seed, the true length given. Borders are right
where the width is within RIGHT of the true one. Of these: how far all true markings in sight lie from proposed ones,
how many of them are there, and how many are proposed that are not painted.
files LENGTH_MM FILE…: what is proposed for pictures of files.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.second_simulator import Scene, render, scene_spec
from touchline.core.errors import FitFailed
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.fields.proposal import proposed_field

RIGHT = 0.02
NEAR = 0.01  # of the length, between a marking and a proposed one that is the same


def off_mm(field: Field, other: Field) -> np.ndarray:
    """Return (m,) rms distances from each marking of a field to the nearest of another."""
    result = []
    for marking in field.markings:
        places = marking.sample(24)[1:-1]
        result.append(
            min(
                float(np.sqrt(np.mean(np.sum((one.nearest(places) - places) ** 2, axis=1))))
                for one in other.markings
            )
        )
    return np.array(result)


def scenes(seeds: range) -> None:
    counts = {"proposed": 0, "right": 0, "declined": 0, "wrong": 0}
    off, there, extra, works = [], [], [], []
    for seed in seeds:
        spec = scene_spec(seed)
        if spec.region != "full":
            continue
        scene: Scene = render(spec)
        begun = time.process_time()
        try:
            told = proposed_field(scene.pixels, scene.field.length_mm, None)
        except FitFailed:
            counts["declined"] += 1
            works.append(time.process_time() - begun)
            continue
        works.append(time.process_time() - begun)
        field = field_from_json(told["field"])
        counts["proposed"] += 1
        if abs(field.width_mm / scene.field.width_mm - 1) > RIGHT:
            counts["wrong"] += 1
            print(
                f"{seed}: {spec.field} {spec.lens} {spec.tilt_deg:.0f}°: {told['sentence']}, {scene.field.width_mm} "
                "mm in truth",
                flush=True,
            )
            continue
        counts["right"] += 1
        apart = off_mm(scene.field, field) / scene.field.length_mm
        off.extend(apart[apart < NEAR])
        there.append(float(np.mean(apart < NEAR)))
        extra.append(int(np.sum(off_mm(field, scene.field) > NEAR * scene.field.length_mm)))
    print(
        f"seeds {seeds.start}-{seeds.stop - 1}, whole fields: {counts}; of the right ones, markings found "
        f"{np.mean(there):.1%}, off by {np.median(off):.2%} of the length, 95 % {np.quantile(off, 0.95):.2%}; "
        f"proposed where no paint is: {sum(extra)} in {len(extra)} fields; seconds by the processor "
        f"{np.median(works):.2f}, most {max(works):.2f}"
    )


def files(length_mm: float, paths: list[Path]) -> None:
    for path in paths:
        try:
            told = proposed_field(cv2.imread(str(path)), length_mm, None)
        except FitFailed as refusal:
            print(f"{path.name}: {refusal}", flush=True)
            continue
        names = [m["name"] for m in (*told["field"]["lines"], *told["field"]["arcs"])]
        print(
            f"{path.name}: {told['sentence']} {len(names)} markings: {', '.join(names)}", flush=True
        )


if __name__ == "__main__":
    kind, *rest = sys.argv[1:]
    if kind == "scenes":
        scenes(range(*map(int, rest)))
    else:
        files(float(rest[0]), [Path(name) for name in rest[1:]])
