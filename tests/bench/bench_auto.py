"""Calibration without clicks. Command: python tests/bench/bench_auto.py random|hidden|wrong|areas FROM TO, or table

random: scenes of tests/support/auto_scenes.py by seed: how many are found, how exactly, and whether any is wrong.
wrong: the same pictures, matched with another field, which must be declined. table: Division B, 1224 × 1024,
lens by tilt, as in the manual's figures. hidden: those of the random ones in which more than a tenth
of the lines is hidden.
areas: the random ones once more, those of a part of the field also with the full field as the covered area.
Seconds are by the clock, which counts who else is at work, and by the processor.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.auto_scenes import (
    FIELDS,
    SceneSpec,
    SeenScene,
    carpet_error_mm,
    error_mm,
    fields,
    scene_of,
    spec_of,
)
from touchline.automatic.request import AutomaticRequest
from touchline.core.records import Calibration, Frame
from touchline.evaluate.areas import NEAR_OVERLAP, better_areas
from touchline.models import model_from_json

RIGHT_MM, RIGHT_PX = 5.0, 0.5  # whichever is more: a wrong assignment is off by decimetres


def asked(
    scene: SeenScene, field_name: str | None = None
) -> tuple[dict, Calibration | None, float, float]:
    """The answer, the calibration where one was made, and seconds by the clock and by the processor."""
    field = fields()[field_name or scene.spec.field]
    region = field.regions.get(scene.spec.region, field.regions["full"])
    clock, work = time.perf_counter(), time.process_time()
    told, made = AutomaticRequest(field, region).answer(Frame(scene.pixels))
    return told, made, time.perf_counter() - clock, time.process_time() - work


def limit_mm(scene: SeenScene) -> float:
    corners = np.array([(x, y) for x in scene.region.x_mm for y in scene.region.y_mm])
    raw = scene.camera.raw_from_field(corners)
    mm_per_px = np.linalg.norm(corners[0] - corners[3]) / np.linalg.norm(raw[0] - raw[3])
    return max(RIGHT_MM, RIGHT_PX * float(mm_per_px))


def random_scenes(seeds: range, least_hidden: float = 0.0) -> None:
    found, errors, clocks, works, wrong, declined = 0, [], [], [], [], []
    for seed in seeds:
        scene = scene_of(spec_of(seed))
        if scene.hidden < least_hidden:
            continue
        told, made, clock, work = asked(scene)
        clocks.append(clock)
        works.append(work)
        if made is None:
            declined.append(seed)
            print(
                f"{seed}: {scene.spec.field} {scene.spec.region}, {scene.hidden:.0%} hidden: declined, "
                f"{told['verdict']['sentence']}",
                flush=True,
            )
            continue
        error = error_mm(made, scene)
        errors.append(error)
        found += error <= limit_mm(scene)
        if error > limit_mm(scene):
            wrong.append(seed)
            print(f"{seed}: WRONG by {error:.1f} mm, called {told['verdict']['level']}", flush=True)
    count = len(clocks)
    print(
        f"seeds {seeds.start}-{seeds.stop - 1}: {found} of {count} right ({found / count:.1%}), {len(declined)} "
        f"declined {declined}, {len(wrong)} wrong {wrong}"
    )
    print(
        f"rms on the carpet, median {np.median(errors):.2f} mm, 95 % {np.quantile(errors, 0.95):.2f} mm, worst "
        f"{max(errors):.2f} mm; seconds by the clock {np.median(clocks):.2f}, worst {max(clocks):.2f}; by the "
        f"processor {np.median(works):.2f}, worst {max(works):.2f}",
        flush=True,
    )


def wrong_fields(seeds: range) -> None:
    called = []
    for seed in seeds:
        scene = scene_of(spec_of(seed))
        others = [name for name in FIELDS if name != scene.spec.field]
        name = others[seed % len(others)]
        told, made, _, _ = asked(scene, name)
        if made is not None:
            called.append(seed)
            print(
                f"{seed}: {scene.spec.field} {scene.spec.region} taken for {name}, called "
                f"{told['verdict']['level']}: {told['proof']}",
                flush=True,
            )
    print(
        f"wrong fields, seeds {seeds.start}-{seeds.stop - 1}: {len(called)} accepted {called}",
        flush=True,
    )


def wrong_areas(seeds: range) -> None:
    """The right area must not be doubted. Chosen is the full field: where the picture shows just a part of it that is
    an area by itself, that or the one opposite must be offered; otherwise nothing wrong may be accepted."""
    counts = dict.fromkeys(
        (
            "right area",
            "doubted",
            "full in place of a part",
            "offered",
            "accepted",
            "wrong",
            "offered another",
        ),
        0,
    )
    for seed in seeds:
        scene = scene_of(spec_of(seed))
        told, made, _, _ = asked(scene)
        counts["right area"] += 1
        if told["areas"]:
            counts["doubted"] += 1
            print(
                f"{seed}: {scene.spec.field} {scene.spec.region} doubted, {told['areas']}",
                flush=True,
            )
        if scene.spec.region == "full":
            continue
        field = fields()[scene.spec.field]
        told, made = AutomaticRequest(field, field.regions["full"]).answer(Frame(scene.pixels))
        right = [
            field.regions[area.region.name]
            for area in better_areas(
                scene.camera.raw_from_field,
                field,
                field.regions["full"],
                scene.camera.image_size,
                True,
                NEAR_OVERLAP,
            )
        ]
        is_right = {area["region"] for area in told["areas"]} <= {area.name for area in right}
        is_wrong = made is not None and error_mm(made, scene) > limit_mm(scene)
        counts["full in place of a part"] += 1
        counts["offered"] += bool(told["areas"]) and is_right
        counts["offered another"] += not is_right
        counts["accepted"] += made is not None
        counts["wrong"] += is_wrong
        if is_wrong or not is_right or (right and not told["areas"]):
            print(
                f"{seed}: {scene.spec.field} {scene.spec.region} as full, wrong: {is_wrong}, "
                f"{told['verdict']['level']}, {told['verdict']['sentence']} offered {told['areas']}, right "
                f"{[area.name for area in right]}",
                flush=True,
            )
    print(f"areas, seeds {seeds.start}-{seeds.stop - 1}: {counts}", flush=True)


def table() -> None:
    for lens in ("mild", "strong", "pincushion"):
        for tilt in (0.0, 12.0, 30.0):
            spec = replace(SPEC, lens=lens, tilt_deg=tilt)
            scene = scene_of(spec)
            told, made, clock, work = asked(scene)
            if made is None:
                print(f"{lens} {tilt:g}°: declined, {told['verdict']['sentence']}")
                continue
            model = model_from_json(made.model_name, made.model_parameters)
            hat = carpet_error_mm(
                lambda raw, m=model: m.unproject(raw, 150.0), scene, height_mm=150.0
            )[0]
            print(
                f"{lens} {tilt:g}°: {error_mm(made, scene):.3f} mm rms on the carpet, {hat:.1f} mm at 150 mm; "
                f"{clock:.2f} s by the clock, {work:.2f} s by the processor; "
                f"{told['report']['verdict']['level']}",
                flush=True,
            )


SPEC = SceneSpec(
    1, "ssl-div-b", "full", "mild", (1224, 1024), 6500.0, 0.0, 0.0, 0.0, 0.65, 2.0, 0.1, 10, 0
)


if __name__ == "__main__":
    what, *ends = sys.argv[1:] or ["table"]
    seeds = range(*(int(e) for e in ends)) if ends else range(200)
    {
        "random": lambda: random_scenes(seeds),
        "hidden": lambda: random_scenes(seeds, 0.1),
        "wrong": lambda: wrong_fields(seeds),
        "areas": lambda: wrong_areas(seeds),
        "table": table,
    }[what]()
