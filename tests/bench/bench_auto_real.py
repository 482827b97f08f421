"""Calibration without clicks on real pictures, the drawn field to be looked at.

Command: python tests/bench/bench_auto_real.py OUT_FOLDER. Reads the pictures beside the project
(../shared/data/fields); writes OUT_FOLDER/NAME.png with the reprojected field over each, and a row: how it was judged,
the median distance of the lines that were found from the drawn field, or why it was declined. One that was declined
shows the points that were found.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.auto_scenes import fields
from touchline.automatic.request import AutomaticRequest
from touchline.core.records import Calibration, Frame
from touchline.drift.check import check
from touchline.models import model_from_json, raw_from_field

DATA = Path(__file__).parents[2] / ".." / "shared" / "data" / "fields"
PICTURES = [
    ("ssl_2008/ssl-field-2008.jpg", "ssl-2008", "half-right"),
    ("ssl_2008/ssl-field-2008.jpg", "ssl-2008", "half-left"),
    *((f"felipersotero/campo_real_0{n}.png", "vsss-3v3", "full") for n in (1, 2, 4)),
    *(
        (f"ger_unicamp_2016/{name}.png", "vsss-3v3", "full")
        for name in ("campo_bonito_1", "campo_bonito_2", "campo_transformado", "image")
    ),
    ("robocin/field.png", "vsss-3v3", "full"),
    ("robocin/all_tags.mp4", "vsss-3v3", "full"),
    ("robocin/static.mp4", "vsss-3v3", "full"),
    ("rodetas/640x480.png", "vsss-3v3", "full"),
    ("rodetas/1280x720.png", "vsss-3v3", "full"),
    ("unball/unball_path1.png", "vsss-3v3", "full"),
    ("vss_sdk/model_2016.jpg", "vsss-3v3", "full"),
    ("vss_sdk/model2_2016.jpg", "vsss-3v3", "full"),
    ("vss_sdk/robot_move.mp4", "vsss-3v3", "full"),
    ("vss_sdk/run_positions.png", "vsss-3v3", "full"),
    ("agh_mirosot/img/a_1.jpg", "vsss-5v5", "full"),
    ("agh_mirosot/img/wc_empty_2windows_whiteLights.png", "vsss-5v5", "full"),
]
GREEN, RED, YELLOW = (80, 255, 80), (60, 60, 255), (0, 220, 255)


def read(path: Path) -> np.ndarray:
    if path.suffix != ".mp4":
        return cv2.imread(str(path))
    film = cv2.VideoCapture(str(path))
    fine, pixels = film.read()
    assert fine, path
    return pixels


def drawn(pixels: np.ndarray, told: dict, made: Calibration | None, field) -> np.ndarray:
    scale = max(1, round(1400 / pixels.shape[1]))
    canvas = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)

    def on(points: np.ndarray) -> np.ndarray:
        return np.round((points + 0.5) * scale - 0.5).astype(np.int32)

    for observation in told["observations"]:
        for point in on(np.array(observation["points"]).reshape(-1, 2)):
            cv2.circle(canvas, tuple(point.tolist()), 2, YELLOW, -1, cv2.LINE_AA)
    if made is not None:
        model = model_from_json(made.model_name, made.model_parameters)
        for shape in (*field.lines.values(), *field.arcs.values()):
            raw = raw_from_field(model, shape.sample(80))
            raw = raw[np.isfinite(raw).all(axis=1)]
            cv2.polylines(canvas, [on(raw)], False, GREEN, 1, cv2.LINE_AA)
    cv2.putText(
        canvas,
        told["verdict"]["sentence"][:110],
        (8, 22),
        cv2.FONT_HERSHEY_SIMPLEX,
        0.55,
        GREEN if made else RED,
        1,
        cv2.LINE_AA,
    )
    return canvas


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    for name, field_name, region in PICTURES:
        path = DATA / name
        if not path.exists():
            print(f"{name}: not here")
            continue
        pixels, field = read(path), fields()[field_name]
        start = time.process_time()
        told, made = AutomaticRequest(field, field.regions[region]).answer(Frame(pixels))
        work = time.process_time() - start
        if made is not None:
            found = check(made, pixels)
            off = np.abs([point["off_mm"] for point in found["points"]])
            print(
                f"{name} {region}: {told['verdict']['level']}, {told['model']}, {told['proof']['rms_px']:.2f} px rms,"
                f" median line distance {np.median(off) if len(off) else np.nan:.2f} mm, expected error "
                f"{told['report']['verdict']['mm']:.1f} mm, {work:.1f} s",
                flush=True,
            )
        else:
            print(
                f"{name} {region}: declined ({told['verdict']['reason']}), {told['verdict']['sentence']} "
                f"{work:.1f} s",
                flush=True,
            )
        cv2.imwrite(
            str(out / f"{path.parent.name}-{path.stem}-{region}.png"),
            drawn(pixels, told, made, field),
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
