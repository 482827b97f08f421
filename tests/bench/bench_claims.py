"""Claims that were made false, and good versions that are doubted, on the second simulator. Commands:

    python tests/bench/bench_claims.py false FROM TO    each case of falsified_claims.py by seed: what is held
    python tests/bench/bench_claims.py good FROM TO     versions by seed whose true error is known: what is doubted

Good: calibrated with the measured height, and off by at most 5 mm rms on the carpet and at robot tops; doubted:
something stands against activating it.
"""

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.falsified_claims import FALSE, World
from tests.support.height_scenes import POINTS, VIEWS, height_scene
from touchline.core.errors import FitFailed
from touchline.evaluate.claims import problems, report_claims
from touchline.evaluate.verdict import FAIR_MM, GOOD_MM
from touchline.models import model_of
from touchline.workflows.calibration_request import CalibrationRequest


def false_claims(seeds: range) -> None:
    found: Counter[str] = Counter()
    for seed in seeds:
        world = World(seed)
        for name, case in FALSE.items():
            try:
                held = case.held(case.claims(world))
            except FitFailed as refusal:
                found["refused"] += 1
                print(f"{seed}: {name}: refused, {refusal.what}", flush=True)
                continue
            found["held" if held else "not held"] += 1
            if held:
                print(f"{seed}: {name}: HELD {held}", flush=True)
    print(f"{len(FALSE)} cases, seeds {seeds.start}-{seeds.stop - 1}: {dict(found)}")


def good_versions(seeds: range) -> None:
    found: Counter[str] = Counter()
    for seed in seeds:
        view, points = list(VIEWS)[seed % len(VIEWS)], POINTS[seed // len(VIEWS) % len(POINTS)]
        scene = height_scene(seed, view, points)
        request = CalibrationRequest(
            scene.observations,
            scene.field,
            scene.region,
            scene.image_size,
            scene.model,
            scene.height_option(),
        )
        try:
            made = request.record(request.preview())
        except FitFailed as refusal:
            found["refused"] += 1
            print(f"{seed}: {view}, {points}: refused, {refusal.what}", flush=True)
            continue
        model = model_of(made)
        off_mm = max(scene.error_mm(model, z_mm) for z_mm in (0.0, scene.field.hat_height_mm))
        against = [claim.code for claim in problems(report_claims(made))]
        is_good = off_mm <= GOOD_MM
        found[("good" if is_good else "not good") + (", doubted" if against else "")] += 1
        if (is_good and against) or (off_mm > FAIR_MM and not against):
            print(
                f"{seed}: {view}, {points}: {off_mm:.1f} mm off, against it {against}", flush=True
            )
    print(f"versions, seeds {seeds.start}-{seeds.stop - 1}: {dict(found)}")


if __name__ == "__main__":
    {"false": false_claims, "good": good_versions}[sys.argv[1]](
        range(int(sys.argv[2]), int(sys.argv[3]))
    )
