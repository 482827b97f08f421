"""Field, covered area and rotation recognised. Command: python tests/bench/bench_recognition.py scenes FROM TO

scenes: the second simulator's, by seed, over all its fields, of which nothing is said. Right is a scene of which field
and area are recognised, alone or among at most three choices, and whose calibration is off by at most 1 px, or by
LIMIT_MM where lines are painted further off than that; with several choices, that of the true one.
others FOLDER…: pictures that show no field of ours, of which none may be accepted. floors FROM TO: drawn tiles, planks
and empty carpets, by seed, of which none may be accepted either. real: see bench_auto_real.py.
Seconds are by the processor.
"""

import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.second_simulator import Scene, render, scene_spec
from tests.support.second_simulator.scene_spec import fields
from touchline.automatic.recognition import RecognitionRequest
from touchline.automatic.request import AutomaticRequest
from touchline.core.field import Region
from touchline.core.records import Calibration, Frame
from touchline.evaluate.areas import MIN_SEEN
from touchline.models import field_from_raw, model_from_json

LIMIT_MM = 15.0
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif")
LARGEST_PX = 4e7
ROLL_DEG = 60.0  # a quarter turn that is further off is another rotation


def errors(made: Calibration, scene: Scene) -> tuple[float, float]:
    """Return the rms error over the visible region in mm and in px, of the better end of a field with two alike."""
    model, region = model_from_json(made.model_name, made.model_parameters), scene.region
    x, y = np.meshgrid(np.linspace(*region.x_mm, 12), np.linspace(*region.y_mm, 9))
    places = np.stack([x, y], axis=-1).reshape(-1, 2)
    raw = scene.camera.project(np.column_stack([places, np.zeros(len(places))]))
    beside = scene.camera.project(
        np.column_stack([places + np.array([1.0, 0.0]), np.zeros(len(places))])
    )
    seen = scene.camera.inside(raw)
    px_per_mm = np.linalg.norm(beside - raw, axis=1)[seen]
    found = field_from_raw(model, raw[seen])
    off = [
        np.nan_to_num(np.linalg.norm(turn * found - places[seen], axis=1), nan=1e5)
        for turn in (1, -1)
    ]
    best = min(off, key=lambda each: float(np.mean(each**2)))
    return float(np.sqrt(np.mean(best**2))), float(np.sqrt(np.mean((best * px_per_mm) ** 2)))


def is_true(choice: dict[str, Any], scene: Scene) -> bool:
    """Whether that is the scene's field, and an area of it that the picture shows, as it stands there."""
    if choice["field"] != scene.field.name:
        return False
    region = scene.field.region(choice["region"], choice["rotate"])
    x, y = np.meshgrid(*(np.linspace(*side, 24) for side in (region.x_mm, region.y_mm)))
    places = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    is_whole = sum(region.x_mm) == sum(region.y_mm) == 0  # its ends are alike
    for turn in (1, -1) if is_whole else (1,):
        seen = float(scene.camera.inside(scene.camera.project(places * (turn, turn, 1))).mean())
        if seen >= MIN_SEEN - 0.1 and abs(turn_deg(scene, region, turn)) <= ROLL_DEG:
            return True
    return False


def turn_deg(scene: Scene, region: Region, turn: int) -> float:
    sides = np.array([region.width_mm, region.height_mm])
    ends = region.field_from_region(np.array([[0.4, 0.5], [0.6, 0.5]]) * sides) * turn
    raw = scene.camera.project(np.column_stack([ends, np.zeros(2)]))
    return float(np.degrees(np.arctan2(*(raw[1] - raw[0])[::-1])))


def scenes(seeds: range) -> None:
    every = tuple(fields().values())
    kinds: dict[str, list[int]] = {
        name: [] for name in ("right", "right of several", "declined", "wrong")
    }
    called, works, off_mm, off_px = [], [], [], []
    for seed in seeds:
        scene = render(scene_spec(seed))
        begun = time.process_time()
        told, made = RecognitionRequest(every).answer(Frame(scene.pixels))
        works.append(time.process_time() - begun)
        choices = told["recognised"]["choices"]
        fitting = [choice for choice in choices if is_true(choice, scene)]
        if len(choices) > 1 and fitting:
            region = scene.field.region(fitting[0]["region"], fitting[0]["rotate"])
            told, made = AutomaticRequest(scene.field, region).answer(Frame(scene.pixels))
        level, name = told["verdict"]["level"], "declined"
        if made is not None:
            mm, px = errors(made, scene)
            is_right = bool(fitting) and (px <= 1.0 or mm <= LIMIT_MM)
            name = "wrong" if not is_right else "right" if len(choices) == 1 else "right of several"
            if is_right:
                off_mm.append(mm)
                off_px.append(px)
            elif level in ("good", "fair"):
                called.append(seed)
        elif len(choices) > 1 and not fitting:
            name = "wrong"
        kinds[name].append(seed)
        if name in ("declined", "wrong"):
            spec = scene.spec
            print(
                f"{seed}: {spec.field} {spec.region} {spec.lens} {spec.tilt_deg:.0f}°: {name}, {choices}, "
                f"{told['verdict']['reason']}, {level}",
                f"{mm:.1f} mm {px:.2f} px" if made is not None else "",
                flush=True,
            )
    count = len(seeds)
    right = len(kinds["right"]) + len(kinds["right of several"])
    print(
        f"seeds {seeds.start}-{seeds.stop - 1}: {right} of {count} right ({right / count:.1%}), "
        f"{len(kinds['right of several'])} of them from several choices; {len(kinds['declined'])} declined, "
        f"{len(kinds['wrong'])} wrong {kinds['wrong']}, called good or fair {called}"
    )
    print(
        f"rms on the carpet {np.median(off_mm):.2f} mm, 95 % {np.quantile(off_mm, 0.95):.1f} mm; "
        f"{np.mean(np.array(off_px) <= 1.0):.1%} within 1 px; seconds {np.median(works):.2f}, 95 % "
        f"{np.quantile(works, 0.95):.2f}, most {max(works):.2f}"
    )


def others(folders: list[Path]) -> None:
    files = (
        file
        for folder in folders
        for file in sorted(folder.rglob("*"))
        if file.suffix.lower() in PICTURES
    )
    pictures = ((str(path), cv2.imread(str(path))) for path in files)
    none_of_ours(
        (name, pixels)
        for name, pixels in pictures
        if pixels is not None and pixels.shape[0] * pixels.shape[1] <= LARGEST_PX
    )


def none_of_ours(pictures: Iterable[tuple[str, np.ndarray]]) -> None:
    every = tuple(fields().values())
    looked, accepted, offered, works = 0, [], [], []
    for path, pixels in pictures:
        looked += 1
        begun = time.process_time()
        told, made = RecognitionRequest(every).answer(Frame(pixels))
        works.append(time.process_time() - begun)
        for names, is_so in (
            (accepted, made is not None),
            (offered, len(told["recognised"]["choices"]) > 1),
        ):
            if is_so:
                names.append(path)
                print(
                    f"{path}: {told['recognised']['sentence']} {told['verdict']['sentence']}",
                    flush=True,
                )
    print(
        f"{looked} pictures of other things: {len(accepted)} accepted, {len(offered)} offered; seconds "
        f"{np.median(works):.2f}, most {max(works):.2f}"
    )


def floor(seed: int) -> np.ndarray:
    """Draw tiles, planks or an empty carpet with an edge, seen from above under some tilt."""
    rng = np.random.default_rng([seed, 63])
    size, side = 2048, int(rng.integers(90, 420))
    kind = ("tiles", "planks", "carpet")[seed % 3]
    ground, joint = rng.uniform(60, 150), rng.choice([-1, 1]) * rng.uniform(20, 70)
    flat = np.full((size, size), ground, np.float32)
    thick, high = int(rng.integers(3, 12)), side if kind == "tiles" else int(rng.integers(40, 90))
    for row in range(0, size if kind != "carpet" else 0, high):
        flat[row : row + thick] += joint
        shift = 0 if kind == "tiles" else int(rng.integers(0, side * 3))
        for column in range(shift, size, side if kind == "tiles" else side * 3):
            flat[row : row + high, column : column + thick] += joint
    if kind == "carpet":
        low, far = rng.integers(150, 400, 2), size - rng.integers(150, 400, 2)
        cv2.rectangle(flat, low.tolist(), far.tolist(), float(ground + 60), thick)
    flat += cv2.GaussianBlur(rng.normal(0, 60, flat.shape).astype(np.float32), (0, 0), 3)
    away = rng.uniform(-0.16, 0.16, (4, 2)) * 900
    corners = np.array([(0, 0), (size, 0), (size, size), (0, size)], np.float32)
    seen = (np.array([(-100, -100), (1380, -100), (1380, 1124), (-100, 1124)]) + away).astype(
        np.float32
    )
    shown = cv2.warpPerspective(
        flat, cv2.getPerspectiveTransform(corners, seen), (1280, 1024), borderValue=float(ground)
    )
    return np.clip(
        cv2.GaussianBlur(shown, (0, 0), 0.7) + rng.normal(0, 2, shown.shape), 0, 255
    ).astype(np.uint8)


if __name__ == "__main__":
    kind, *rest = sys.argv[1:]
    if kind == "scenes":
        scenes(range(*map(int, rest)))
    elif kind == "floors":
        none_of_ours((f"floor {seed}", floor(seed)) for seed in range(*map(int, rest)))
    else:
        others([Path(name) for name in rest])
