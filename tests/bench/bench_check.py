"""What a check says of a calibration that holds, one that has moved and one that was never right. Command:

    python tests/bench/bench_check.py [COUNT] [FIRST]

Scenes of the second simulator, calibrated without clicks, and by poorer models on the same borders; each is checked in
its own picture, in another one of the same camera, in one of the camera turned by 0.3°, and as another program's file
that is wrong. What is right is told by the true cameras alone.
"""

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.second_simulator import Scene, render, scene_spec
from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.scene_spec import fields
from touchline.automatic.request import AutomaticRequest
from touchline.core.errors import TouchlineError
from touchline.core.field import BORDERS
from touchline.core.geometry import as_triple
from touchline.core.records import Calibration, Frame, observations_from_json
from touchline.drift.check import Check, check
from touchline.evaluate.uncertainty import grid_over
from touchline.formats.camera_file import CameraFile
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.interchange import ImportOptions, calibration_from_file, export, read_file

TURN_DEG = 0.3
SIZE = (780, 580)
POORER = ("polynomial", "homography")
GOOD_MM = 5.0
CLAIMS = {
    "moved": "moved",
    "lens": "moved",
    "elsewhere": "moved",
    "never-right": "never right",
    "holds": "as it was",
    "as-made": "as it was",
    "lines-missing": "lines missing",
    "not-seen": "inconclusive",
}


def scene_at(seed: int) -> Scene | None:
    """Return the seed's scene in a small picture; None where no camera sees its lines in one."""
    try:
        return render(scene_spec(seed, size=SIZE))
    except ValueError:
        return None


def turned(camera: OpenCvCamera, degrees: float, rng: np.random.Generator) -> OpenCvCamera:
    """The camera turned about a random axis through it."""
    axis = rng.normal(size=3)
    turn = np.asarray(cv2.Rodrigues(np.radians(degrees) * axis / np.linalg.norm(axis))[0], float)
    rotation = turn @ camera.camera_from_field
    return replace(
        camera,
        rotation=as_triple(cv2.Rodrigues(rotation)[0].ravel()),
        translation_mm=as_triple(-rotation @ camera.position_mm),
    )


def moved_mm(before: OpenCvCamera, after: OpenCvCamera, scene: Scene) -> float:
    """How far the first camera has the carpet that both see from where it lies in the second, 95 % of the region."""
    places = grid_over(scene.region).reshape(-1, 2)
    pixels = after.project(np.column_stack([places, np.zeros(len(places))]))
    off = np.linalg.norm(
        before.carpet_from_pixel(pixels[after.inside(pixels)]) - places[after.inside(pixels)],
        axis=1,
    )
    return float(np.nanpercentile(off, 95))


def calibrations(scene: Scene) -> Iterator[tuple[str, Calibration]]:
    """Without clicks, and by poorer models on the borders that were detected."""
    told, made = AutomaticRequest(scene.field, scene.region).answer(Frame(scene.pixels))
    if made is None:
        return
    yield "auto", made
    borders = observations_from_json([o for o in told["observations"] if o["feature"] in BORDERS])
    for model in POORER:
        request = CalibrationRequest(borders, scene.field, scene.region, made.image_size, model)
        try:
            yield model, request.record(request.run())
        except TouchlineError:
            continue  # a border is not in sight


def imported(made: Calibration, here: Calibration) -> Calibration | None:
    """Another program's file of a camera, read for the camera of `here`; None for one that no such file holds."""
    try:
        data = export(made, "ssl-vision", approximate=True).data
        found = read_file(data, "camera.txt")
        assert isinstance(found, CameraFile)
        return calibration_from_file(
            replace(found, image_size=None),
            ImportOptions(here.field["name"], here.region, here.rotate, here.image_size),
            fields(),
        )
    except TouchlineError:
        return None


def posed_wrong(made: Calibration, rng: np.random.Generator) -> Calibration:
    """Turned by 2 to 6 degrees, and 100 to 400 mm beside its place."""
    parameters = dict(made.model_parameters)
    axis, way = rng.normal(size=3), rng.normal(size=3) * (1, 1, 0.3)
    turn = cv2.Rodrigues(np.radians(rng.uniform(2, 6)) * axis / np.linalg.norm(axis))[0]
    rotation = turn @ cv2.Rodrigues(np.array(parameters["rotation"], float))[0]
    off = rng.uniform(100, 400) * way / np.linalg.norm(way)
    return replace(
        made,
        model_parameters={
            **parameters,
            "rotation": cv2.Rodrigues(rotation)[0].ravel().tolist(),
            "position_mm": (np.array(parameters["position_mm"]) + off).tolist(),
        },
    )


def foreign(
    made: Calibration,
    before: Calibration | None,
    rng: np.random.Generator,
) -> Iterator[tuple[str, Calibration]]:
    """before: of another camera over the same field."""
    other = imported(made, made)
    if other is None or "position_mm" not in other.model_parameters:
        return
    yield "foreign, right", other
    yield "foreign, wrong pose", posed_wrong(other, rng)
    if before is not None and (its := imported(before, made)) is not None:
        yield "foreign, another camera's", its


def wrong(case: str, found: Check, made: Calibration, moved: float) -> str:
    """Return what is wrong with a verdict; empty for a right one."""
    told, level = CLAIMS[found["verdict"]["reason"]], found["verdict"]["level"]
    own = made.report["verdict"]["level"]
    if case in ("own", "later"):
        if told in ("moved", "never right"):
            return "called " + told
        return (
            "better than its own report"
            if own in ("fair", "poor") and level in ("good", *(("fair",) if own == "poor" else ()))
            else ""
        )
    if case == "turned":
        promised = (made.report.get("sigma_mm") or {}).get("rms_95") or 0.0
        must = moved > max(promised, made.report["verdict"]["mm"] or 0.0, GOOD_MM)
        return (
            "called " + told
            if told == "never right" or (must and told != "moved")
            else ("good" if must and level == "good" else "")
        )
    return (
        "called moved"
        if told == "moved"
        else "good"
        if level == "good" and case != "foreign, right"
        else ""
    )


def rows(
    scene: Scene, seed: int, before: Calibration | None
) -> Iterator[tuple[str, str, Check, Calibration, float]]:
    rng = np.random.default_rng([seed, 23])
    spec = scene.spec
    things = replace(
        spec.things,
        robots=int(rng.integers(0, 11)),
        people=int(rng.random() < 0.25),
        shade=int(rng.integers(0, 3)),
        glare=int(rng.integers(0, 3)),
    )
    knocked = turned(scene.camera, TURN_DEG, rng)
    pictures = {
        "own": (scene, 0.0),
        "later": (render(replace(spec, things=things), moment=1), 0.0),
        "turned": (render(spec, knocked, moment=2), moved_mm(scene.camera, knocked, scene)),
    }
    for model, made in calibrations(scene):
        for case, (now, moved) in pictures.items():
            yield model, case, check(made, now.pixels), made, moved
        if model == "auto":
            for case, other in foreign(made, before, rng):
                yield model, case, check(other, scene.pixels), other, 0.0


def run(count: int, first: int) -> None:
    table: dict[tuple[str, str, str], Counter[str]] = defaultdict(Counter)
    bad: list[Any] = []
    last: dict[str, Calibration] = {}
    done, seed = 0, first
    while done < count:
        scene, latest = scene_at(seed), None
        if scene is None:
            seed += 1
            continue
        for model, case, found, made, moved in rows(scene, seed, last.get(scene.field.name)):
            own, verdict, change = (
                made.report["verdict"]["level"],
                found["verdict"],
                found["change"],
            )
            table[model, case, own][f"{CLAIMS[verdict['reason']]}, {verdict['level']}"] += 1
            why = wrong(case, found, made, moved)
            told = f"{seed} {model} {case} (own: {own}, {made.report['verdict']['mm'] or np.nan:.1f} mm)"
            print(
                told,
                verdict["reason"],
                verdict["level"],
                f"truly moved {moved:.1f}",
                change and {name: round(float(mm), 2) for name, mm in change.items()},
                f"p95 {found['p95_mm'] or np.nan:.1f}",
                "WRONG: " + why if why else "",
                flush=True,
            )
            if why:
                bad.append((told, why, verdict["sentence"]))
            latest = made if (model, case) == ("auto", "own") else latest
        if latest is not None:
            last[scene.field.name] = latest
        done, seed = done + (latest is not None), seed + 1
    print(f"{done} scenes, seeds {first}-{seed - 1}")
    for (model, case, own), told in sorted(table.items()):
        print(
            f"| {model} | {case} | {own} | {sum(told.values())} | "
            + "; ".join(f"{words}: {n}" for words, n in told.most_common())
            + " |"
        )
    print(f"{len(bad)} wrong", *bad, sep="\n")


if __name__ == "__main__":
    run(int(sys.argv[1]) if len(sys.argv) > 1 else 60, int(sys.argv[2]) if len(sys.argv) > 2 else 0)
