"""Accuracy on the second simulator. Command: python tests/bench/bench_real_cameras.py KIND FROM TO [OPTIONS]

KIND auto: no clicks, on rendered scenes by seed. moved: the same, then a knock, and registered again. clicks: nine on
each border that is in sight, σ 0.4 px, the height by tape to 30 mm, off the same cameras, for each model with a lens;
"recommended" is the one that a comparison of all models names.
"bound" is a fit that knows the kind of the true lens, and the true σ of clicks and lines; without clicks, to the same
points.
OPTIONS is JSON: options of the fit, and "scene" (members of SceneSpec that are not drawn), "exact" (lines as the rules
say), "inside" (so many clicks on lines inside the field), "strong" (every second camera has a strong barrel or a
fisheye), "tape" (auto: the height by tape as for clicks), "verbose".
The true error is the rms over a grid of the region in sight, on the carpet and at robot height; beside it stands the
error that Touchline expected there. Seconds are by the processor.
"""

import json
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.second_simulator import SceneSpec, render, scene_spec
from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.paint import PaintErrors
from tests.support.second_simulator.scene_spec import camera_of, fields, region_of
from touchline.automatic import assignment
from touchline.automatic.search import search
from touchline.core.errors import TouchlineError
from touchline.core.field import BORDERS, Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Fit, Frame, Observation
from touchline.drift.reregister import reregister
from touchline.evaluate.comparison import FittedModel, compare_models, parameter_count
from touchline.evaluate.uncertainty import expected_error, grid_over, knows_its_error
from touchline.fitting import FITTERS
from touchline.models import RayModel, field_from_raw
from touchline.workflows.calibration import CalibrationResult, calibrate
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.model_choice import LADDER

CLICK_MODELS = ("brown-conrady", "fisheye", "division", "ssl")
STRONG = ("gopro-hero3", "tum-vi-fisheye", "m12-3.6mm", "usb-fisheye-170")
NEAR_BEST = 1.5
CLICKS, CLICK_PX, TAPE_MM = 9, 0.4, 30.0
KNOCK_DEG, KNOCK_MM = 0.3, 10.0
LIMIT_MM = 7.5
UNREACHED_MM = 1e5


def true_and_expected(
    fit: Fit, camera: OpenCvCamera, field: Field, region: Region
) -> dict[str, float]:
    """Return rms errors in mm, true and expected, on the carpet and at robot height, where the camera sees them.

    A whole field turned by half a turn looks the same: then the error is that of the nearer of the two.
    """
    grid = grid_over(region).reshape(-1, 2)
    result = {}
    whole = np.ptp(region.x_mm) == field.length_mm and np.ptp(region.y_mm) == field.width_mm
    turns = (1.0, -1.0) if whole else (1.0,)
    for name, z_mm in (("carpet", 0.0), ("hat", field.hat_height_mm)):
        if z_mm and not isinstance(fit.model, RayModel):
            result |= {name: np.nan, f"{name}_expected": np.nan}
            continue
        pixels = camera.project(np.column_stack([grid, np.full(len(grid), z_mm)]))
        seen = camera.inside(pixels)
        rays = isinstance(fit.model, RayModel)
        found = (
            fit.model.unproject(pixels[seen], z_mm)
            if rays
            else field_from_raw(fit.model, pixels[seen])
        )
        off = [np.linalg.norm(turn * found - grid[seen], axis=1) for turn in turns]
        result[name] = min(
            float(np.sqrt(np.mean(np.where(np.isfinite(o), o, UNREACHED_MM) ** 2))) for o in off
        )
        known = knows_its_error(fit) and not fit.model.INTERPOLATES
        result[f"{name}_expected"] = (
            expected_error(fit, region, z_mm, grid[seen][None]).rms if known else np.nan
        )
    return result


def spec_of(seed: int, scene: Mapping[str, Any], exact: bool) -> SceneSpec:
    spec = scene_spec(seed, **{k: tuple(v) if isinstance(v, list) else v for k, v in scene.items()})
    straight = replace(spec.paint, line_sigma_mm=0.0, gross_mm=0.0, slope_sigma=0.0)
    return replace(spec, paint=straight) if exact else spec


def auto_row(
    seed: int,
    options: Mapping[str, Any],
    scene: Mapping[str, Any],
    exact: bool,
    tape: bool,
    moved: bool,
) -> dict[str, Any]:
    spec = spec_of(seed, scene, exact)
    made = render(spec)
    options = {
        **(by_tape(made.camera, np.random.default_rng([seed, 3])) if tape else {}),
        **options,
    }
    row: dict[str, Any] = {
        "seed": seed,
        "scene": f"{spec.field} {spec.region} {spec.lens} {spec.tilt_deg:.0f}°",
    }
    begin = time.process_time()
    lines = assignment.detect_lines(Frame(made.pixels).pixels)
    found = assignment.points_on_lines(
        lines, made.field, made.region, search(lines.seen, made.field, made.region)
    )
    if found is None:
        return {**row, "state": "no match", "seconds": time.process_time() - begin}
    done = None
    for models in LADDER:
        try:
            done, found = assignment.calibrate(
                found, lines, made.field, made.region, models, options
            )
            break
        except TouchlineError as refused:
            row["refused"] = refused.what
    proof = assignment.verify(found, lines, made.region)
    row["seconds"] = time.process_time() - begin
    if done is None:
        return {**row, "state": "no fit"}
    doubts = [doubt["reason"] for doubt in proof.doubts()]
    row |= {"state": "doubt" if doubts else "found", "doubts": doubts, "model": done.model.NAME}
    observations, camera = found.observations, made.camera
    if moved:
        request = CalibrationRequest(
            observations, made.field, made.region, lines.size, done.model.NAME, options
        )
        camera = knocked(made.camera, np.random.default_rng([seed, 5]))
        after, begin = Frame(render(spec, camera).pixels), time.process_time()
        try:
            done, observations = registered_again(request.record(done), after, Frame(made.pixels))
        except TouchlineError as refused:
            return {**row, "state": "refused", "refused": refused.what}
        row["seconds"] = time.process_time() - begin
    row |= {
        "level": done.report["verdict"]["level"],
        **true_and_expected(done.fit, camera, made.field, made.region),
    }
    return row | bound(observations, spec, camera, options)


def knocked(camera: OpenCvCamera, rng: np.random.Generator) -> OpenCvCamera:
    """Return the camera turned by some tenths of a degree and shifted by centimetres."""
    turn = cv2.Rodrigues(rng.normal(0, np.radians(KNOCK_DEG), 3))[0]
    rotation = turn @ camera.camera_from_field
    position = camera.position_mm + rng.normal(0, KNOCK_MM, 3)
    return replace(
        camera,
        rotation=tuple(cv2.Rodrigues(rotation)[0].ravel().tolist()),
        translation_mm=tuple((-rotation @ position).tolist()),
    )


def registered_again(
    calibration: Calibration,
    frame: Frame,
    before: Frame,
) -> tuple[CalibrationResult, tuple[Observation, ...]]:
    """Return the new calibration, and the points that it rests on."""
    made = reregister(calibration, frame, before=before)[1]
    request = CalibrationRequest.of(made, made.options, "")
    return calibrate(
        request.observations,
        request.field,
        request.region,
        request.image_size,
        request.model,
        request.options,
    ), request.observations


def bound(
    observations: tuple[Observation, ...],
    spec: SceneSpec,
    camera: OpenCvCamera,
    options: Mapping[str, Any],
) -> dict[str, float]:
    """Return the errors of a fit to these points that knows the kind of the true lens, and the σ of the lines."""
    field, region = fields()[spec.field], region_of(spec)
    known = {"line_sigma_mm": spec.paint.line_sigma_mm} if spec.paint.line_sigma_mm else {}
    try:
        fit = FITTERS["fisheye" if camera.fisheye else "brown-conrady"].fit(
            observations, field, region, ImageSize(*spec.size), {**options, **known}
        )
    except TouchlineError:
        return {}
    true = true_and_expected(fit, camera, field, region)
    return {"carpet_bound": true["carpet"], "hat_bound": true["hat"]}


def click_rows(
    seed: int,
    options: Mapping[str, Any],
    scene: Mapping[str, Any],
    exact: bool,
    inside: int,
) -> list[dict[str, Any]]:
    spec, rng = spec_of(seed, scene, exact), np.random.default_rng([seed, 3])
    camera, region, field = camera_of(spec), region_of(spec), fields()[spec.field]
    observations = (
        *clicks(spec.paint, camera, region, rng),
        *clicks_inside(spec.paint, camera, field, inside, rng),
    )
    known = {"click_sigma_px": CLICK_PX, "line_sigma_mm": spec.paint.line_sigma_mm}
    tried = [(model, model, {}) for model in FITTERS]
    tried.append(("bound", "fisheye" if camera.fisheye else "brown-conrady", known))
    height = by_tape(camera, rng)
    rows, fitted = [], []
    for title, model, more in tried:
        row: dict[str, Any] = {
            "seed": seed,
            "scene": f"{spec.field} {spec.region} {spec.lens} {spec.tilt_deg:.0f}°",
            "model": title,
        }
        mine = {
            name: value
            for name, value in {**height, **options, **more}.items()
            if name in {option.name for option in FITTERS[model].OPTIONS}
        }
        begin = time.process_time()
        try:
            done = calibrate(observations, field, region, ImageSize(*spec.size), model, mine)
        except TouchlineError as refused:
            rows.append(
                {
                    **row,
                    "state": "no fit",
                    "refused": refused.what,
                    "seconds": time.process_time() - begin,
                }
            )
            continue
        if title != "bound":
            fitted.append(
                FittedModel(model, model, done.fit, done.report, parameter_count(done.fit))
            )
        rows.append(
            {
                **row,
                "state": "found",
                "seconds": time.process_time() - begin,
                "level": done.report["verdict"]["level"],
                "warnings": [warning["reason"] for warning in done.report["warnings"]],
                **true_and_expected(done.fit, camera, field, region),
            }
        )
    chosen = compare_models(fitted, region)["recommended"] if fitted else None
    rows += [
        {**row, "model": "recommended", "of": chosen} for row in rows if row["model"] == chosen
    ]
    return rows


def by_tape(camera: OpenCvCamera, rng: np.random.Generator) -> dict[str, Any]:
    return {
        "height_mm": {
            "value": float(camera.position_mm[2] + rng.normal(0, TAPE_MM)),
            "sigma": TAPE_MM,
        }
    }


def clicks(
    paint: PaintErrors,
    camera: OpenCvCamera,
    region: Region,
    rng: np.random.Generator,
) -> tuple[Observation, ...]:
    """Click each border in sight, as painted: beside its place by the paint's σ."""
    observations = []
    for name in BORDERS:
        border = region.border(name).shifted(float(rng.normal(0, paint.line_sigma_mm)))
        along = border.sample(400)
        pixels = camera.project(np.column_stack([along, np.zeros(len(along))]))
        pixels = pixels[camera.inside(pixels, 3)]
        if len(pixels) >= CLICKS:
            chosen = rng.choice(len(pixels), CLICKS, replace=False)
            noisy = pixels[chosen] + rng.normal(0, CLICK_PX, (CLICKS, 2))
            observations.append(
                Observation(name, "line", np.clip(noisy, 0, np.array(camera.size) - 1.0))
            )
    return tuple(observations)


def clicks_inside(
    paint: PaintErrors,
    camera: OpenCvCamera,
    field: Field,
    count: int,
    rng: np.random.Generator,
) -> tuple[Observation, ...]:
    """Click so many points on lines inside the field, three on each that is in sight."""
    observations: list[Observation] = []
    names = [
        name
        for name, line in field.lines.items()
        if max(np.ptp([line.start[0], line.end[0]]), np.ptp([line.start[1], line.end[1]]))
        < field.length_mm - 1
        and abs(line.start[0]) < field.length_mm / 2 - 1
        and abs(line.start[1]) < field.width_mm / 2 + 1
    ]
    for name in rng.permutation(names):
        line = field.lines[str(name)].shifted(float(rng.normal(0, paint.line_sigma_mm)))
        along = line.sample(100)[5:-5]
        pixels = camera.project(np.column_stack([along, np.zeros(len(along))]))
        pixels = pixels[camera.inside(pixels, 3)]
        if len(pixels) >= 3 and 3 * len(observations) < count:
            noisy = pixels[rng.choice(len(pixels), 3, replace=False)] + rng.normal(
                0, CLICK_PX, (3, 2)
            )
            observations.append(
                Observation(str(name), "line", np.clip(noisy, 0, np.array(camera.size) - 1.0))
            )
    return tuple(observations)


def compare_clicks(rows: list[dict[str, Any]]) -> None:
    """Print how the recommended fits stand to the best of all, and to the bound."""
    of = {(row["seed"], row["model"]): row for row in rows if row["state"] == "found"}
    chosen = [
        (row, of[row["seed"], "bound"])
        for row in rows
        if row["model"] == "recommended" and (row["seed"], "bound") in of
    ]
    best = {
        row["seed"]: min(
            of[row["seed"], m]["carpet"] for m in CLICK_MODELS if (row["seed"], m) in of
        )
        for row, _ in chosen
    }
    near = {
        name: np.mean([pair[k]["carpet"] <= NEAR_BEST * best[pair[k]["seed"]] for pair in chosen])
        for k, name in enumerate(("recommended", "bound"))
    }
    print(
        f"median recommended {np.median([row['carpet'] for row, _ in chosen]):.2f} mm, of the bound "
        f"{np.median([bound['carpet'] for _, bound in chosen]):.2f} mm; within {NEAR_BEST} of the best of all: "
        + ", ".join(f"{name} {share:.1%}" for name, share in near.items())
    )


def summarise(title: str, rows: list[dict[str, Any]]) -> None:
    found = [row for row in rows if row["state"] == "found"]
    states = {
        state: sum(row["state"] == state for row in rows)
        for state in sorted({row["state"] for row in rows})
    }
    print(
        f"{title}: {states}; {np.median([r['seconds'] for r in rows]):.2f} s, "
        f"p95 {np.quantile([r['seconds'] for r in rows], 0.95):.2f} s"
    )
    if not found:
        return
    for name in ("carpet", "hat"):
        true, expected = (
            np.array([row[key] for row in found]) for key in (name, f"{name}_expected")
        )
        ratio = true / expected
        if np.isnan(ratio).any():  # borders are no camera: they know no error
            print(f"  {name}: median {np.median(true):.2f}, worst {true.max():.0f} mm")
            continue
        p90, p95 = np.quantile(true, [0.9, 0.95])
        print(
            f"  {name}: median {np.median(true):.2f}, p90 {p90:.1f}, p95 {p95:.1f}, worst {true.max():.0f} mm; "
            f"expected {np.median(expected):.2f}; true over expected {np.median(ratio):.2f}, over 2 in "
            f"{np.mean(ratio > 2):.1%}"
        )
        known = np.array(
            [(row[name], row[f"{name}_bound"]) for row in found if f"{name}_bound" in row]
        )
        if len(known):
            print(
                f"    the bound's median {np.median(known[:, 1]):.2f} mm, where this is {np.median(known[:, 0]):.2f}"
            )
    if "level" in found[0]:
        worst = [float(np.nanmax([row["carpet"], row["hat"]])) for row in found]
        good = [row["level"] == "good" for row in found]
        wrong = [
            row["seed"]
            for row, mm, yes in zip(found, worst, good, strict=True)
            if yes and mm > LIMIT_MM
        ]
        under = [yes for yes, mm in zip(good, worst, strict=True) if mm <= LIMIT_MM]
        print(
            f"  called good {sum(good)}, of which over {LIMIT_MM} mm: {wrong}; of those under it "
            + (f"{np.mean(under):.1%} called good" if under else "none")
        )


if __name__ == "__main__":
    kind, seeds = sys.argv[1], range(int(sys.argv[2]), int(sys.argv[3]))
    given = json.loads(sys.argv[4]) if len(sys.argv) > 4 else {}
    scene, exact, verbose = (
        given.pop("scene", {}),
        given.pop("exact", False),
        given.pop("verbose", False),
    )
    inside, tape, strong = (
        given.pop("inside", 0),
        given.pop("tape", False),
        given.pop("strong", False),
    )
    every: list[dict[str, Any]] = []
    for seed in seeds:
        if strong and seed % 2:
            scene = {**scene, "lens": STRONG[seed // 2 % len(STRONG)]}
        elif strong:
            scene.pop("lens", None)
        new = (
            [auto_row(seed, given, scene, exact, tape, kind == "moved")]
            if kind != "clicks"
            else click_rows(seed, given, scene, exact, inside)
        )
        every += new
        for row in new if verbose else ():
            print(json.dumps(row, default=float), flush=True)
    if kind == "clicks":
        for title in (*FITTERS, "recommended", "bound"):
            summarise(title, [row for row in every if row["model"] == title])
        compare_clicks(every)
    else:
        summarise(kind, every)
