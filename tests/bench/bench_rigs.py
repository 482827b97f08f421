"""A rig's figures: the stitched picture against bare remaps, and what a check tells against the truth.

PYTHONPATH=.:tests python tests/bench/bench_rigs.py [stitch|check|tops]
"""

import sys
import time
from dataclasses import replace

import cv2
import numpy as np

from tests.support.rig_over_field import (
    FIELD,
    HALVES,
    apart_in_truth,
    random_halves,
    sim_rig,
    sim_source,
    with_member,
)
from touchline.core.records import observations_from_json
from touchline.evaluate.agreement import agreement, expected_at_tops
from touchline.evaluate.offsets import from_clicks
from touchline.models import field_from_raw, model_of
from touchline.rigs.check import check
from touchline.rigs.mosaic import FieldView, stitcher_of

WIDTH = 1600
ROUNDS = 40
KNOCK_MM = (18.0, 24.0)


def stitch(count: int) -> None:
    """Median time of a stitched picture over that of cv2.remap with each camera's fixed maps, for the same windows."""
    rig = sim_rig(count)
    names = list(rig.titles)
    pictures = [sim_source(count, number).read().pixels for number in range(count)]
    begun = time.perf_counter()
    made, _ = stitcher_of(rig, names, FieldView(FIELD, WIDTH))
    maps_s = time.perf_counter() - begun
    parts = [(part.map._fixed, pixels) for part, pixels in zip(made.parts, pictures, strict=True)]
    ours, bare = [], []
    for _ in range(ROUNDS):  # in turns, so that a busy machine is as busy for both
        begun = time.perf_counter()
        made.stitch(pictures)
        between = time.perf_counter()
        for fixed, pixels in parts:
            cv2.remap(pixels, *fixed, interpolation=cv2.INTER_LINEAR)
        bare.append(time.perf_counter() - between)
        ours.append(between - begun)
    ratio = np.median(np.array(ours) / np.array(bare))
    print(
        f"{count} cameras, {WIDTH} px wide: {1e3 * np.median(ours):.1f} ms, {ratio:.2f} × the bare remaps "
        f"({1e3 * np.median(bare):.1f} ms); maps once in {maps_s:.2f} s"
    )


def judge(count: int, seed: int, knocked: bool) -> None:
    """Told and true disagreement, mm, over the map of every pair."""
    rig = sim_rig(count, seed)
    if knocked:
        calibration = rig.cameras[1].calibration
        x, y, z = calibration.model_parameters["position_mm"]
        moved = {
            **calibration.model_parameters,
            "position_mm": [x + KNOCK_MM[0], y + KNOCK_MM[1], z],
        }
        rig = with_member(rig, 1, calibration=replace(calibration, model_parameters=moved))
    cameras = {f"cam{number}": sim_source(count, number).camera for number in range(count)}
    found = check(
        rig, {f"cam{n}": sim_source(count, n, seed + 1).read().pixels for n in range(count)}
    )
    models = {c.camera: model_of(c.calibration) for c in rig.cameras}
    told, true, named = [], [], 0
    for pair in found["pairs"]:
        if pair["agreement"] is None:
            continue
        cells = pair["agreement"]["carpet"]["map"]
        mm = np.array(cells["mm"], float)
        places = np.stack(np.meshgrid(cells["x"], cells["y"]), axis=-1)[np.isfinite(mm)]
        at = [
            field_from_raw(models[name], cameras[name].raw_from_field(places))
            for name in (pair["a"], pair["b"])
        ]
        told.append(mm[np.isfinite(mm)])
        true.append(np.linalg.norm(at[1] - at[0], axis=1))
        named += "The error is in Camera 1" in pair["verdict"]["fix"]
    told, true = np.concatenate(told), np.concatenate(true)
    print(
        f"{count} cameras, operator {seed}, {'one knocked by 30 mm' if knocked else 'as calibrated'}: told mean "
        f"{told.mean():.1f}, worst {told.max():.1f} mm; true mean {true.mean():.1f}, worst {true.max():.1f} mm; "
        f"named in {named} of {len(found['pairs'])} pairs"
    )


def tops(rigs: int, height_sigma_mm: float | None) -> None:
    """Told over true disagreement at robot tops, of rigs that hang anyhow, checked by their clicks."""
    ratios = []
    for seed in range(rigs):
        made, cameras = random_halves(seed, height_sigma_mm)
        models = [model_of(calibration) for calibration in made]
        of_a, of_b = (
            (model, observations_from_json(calibration.observations), FIELD.region(half))
            for model, calibration, half in zip(models, made, HALVES, strict=True)
        )
        expected = expected_at_tops(made[0]), expected_at_tops(made[1])
        hat = agreement(
            models[0],
            made[0].image_size,
            models[1],
            made[1].image_size,
            FIELD,
            from_clicks(*of_a, *of_b, FIELD),
            expected=expected,
        )["hat"]
        mm = np.array(hat["map"]["mm"], float)
        places = np.stack(np.meshgrid(hat["map"]["x"], hat["map"]["y"]), axis=-1)[np.isfinite(mm)]
        true = apart_in_truth(models, cameras, places, FIELD.hat_height_mm)
        ratios.append(
            [
                hat["p95_mm"] / np.nanpercentile(true, 95),
                hat["max_mm"] / np.nanmax(true),
                hat["p95_mm"],
                np.nanpercentile(true, 95),
            ]
        )
    low, middle = np.min(ratios, axis=0), np.median(ratios, axis=0)
    print(
        f"{rigs} rigs, heights {'unknown' if height_sigma_mm is None else f'to {height_sigma_mm:g} mm'}: told over "
        f"true at robot tops, p95 least {low[0]:.2f}, median {middle[0]:.2f}; largest least {low[1]:.2f}, median "
        f"{middle[1]:.2f}; p95 median told {middle[2]:.0f}, true {middle[3]:.0f} mm"
    )


if __name__ == "__main__":
    which = sys.argv[1:] or ["stitch", "check", "tops"]
    if "stitch" in which:
        for cameras_above in (2, 4):
            stitch(cameras_above)
    if "check" in which:
        for cameras_above in (2, 4):
            for operator in (0, 1):
                for was_knocked in (False, True):
                    judge(cameras_above, operator, was_knocked)
    if "tops" in which:
        for sigma_mm in (20.0, None):
            tops(20, sigma_mm)
