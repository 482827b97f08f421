"""Lines as thin as one pixel, drawn with the field known: over width, sharpening and noise, how many are detected.

    python tests/bench/bench_thin_lines.py

40 drawings of a webcam's size, bright lines of 0.8 to 1.5 px on dark ground: drawn finely and averaged, as a lens and a
sensor do, or as a stair of whole pixels ("stair"). Sharpening is an unsharp mask, as webcams have it.
"""

import itertools
import time

import cv2
import numpy as np

from tests.support.auto_scenes import SceneSpec, SeenScene, camera_of, carpet_error_mm, fields
from touchline.automatic.request import AutomaticRequest
from touchline.core.records import Frame
from touchline.models import field_from_raw, model_from_json

SIZE = (640, 480)
WIDTHS = ("stair", 0.8, 1.0, 1.25, 1.5)  # px
SHARPEN = (0.0, 1.5)
NOISES = (2.0, 5.0)  # grey levels
FIELDS = ("vsss-3v3", "ssl-div-b")
GROUND, PAINT = 35, 230  # grey levels
FINER, SHIFT = 8, 4  # times as fine as the picture; bits of a pixel's fractions


def drawing(seed: int, field: str, width: float | str, sharpen: float, noise: float) -> SeenScene:
    rng = np.random.default_rng(seed)
    spec = SceneSpec(
        seed,
        field,
        "full",
        "mild",
        SIZE,
        2500.0 if field == "vsss-3v3" else 6000.0,
        float(rng.uniform(0, 10)),
        0.0,
        float(rng.uniform(-6, 6)),
        0.0,
        0.0,
        0.0,
        0,
        0,
    )
    camera = camera_of(spec)
    finer = 1 if width == "stair" else FINER
    pixels = np.full((SIZE[1] * finer, SIZE[0] * finer), GROUND, np.uint8)
    for marking in fields()[field].markings:
        raw = camera.raw_from_field(marking.sample(200))
        ends = np.round(((raw + 0.5) * finer - 0.5) * 2**SHIFT).astype(np.int32)
        thickness = 1 if width == "stair" else round(float(width) * finer)
        cv2.polylines(
            pixels,
            [ends],
            False,
            PAINT,
            thickness,
            cv2.LINE_8 if finer == 1 else cv2.LINE_AA,
            SHIFT,
        )
    exact = cv2.resize(pixels, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64)
    exact += sharpen * (exact - cv2.GaussianBlur(exact, (0, 0), 1.0)) + rng.normal(
        0, noise, exact.shape
    )
    shown = cv2.cvtColor(np.clip(np.round(exact), 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)
    return SeenScene(spec, shown, camera, fields()[field], fields()[field].region("full"), 0.0)


def main() -> None:
    found, shares, errors, works = 0, [], [], []
    cases = list(itertools.product(FIELDS, WIDTHS, SHARPEN, NOISES))
    for seed, case in enumerate(cases):
        scene = drawing(seed, *case)
        begun = time.process_time()
        told, made = AutomaticRequest(scene.field, scene.region).answer(Frame(scene.pixels))
        works.append(time.process_time() - begun)
        share = told["proof"]["found_share"] if told["proof"] else 0.0
        shares.append(share)
        off = np.nan
        if made is not None:
            model = model_from_json(made.model_name, made.model_parameters)
            off = carpet_error_mm(lambda raw, model=model: field_from_raw(model, raw), scene)[0]
            errors.append(off)
            found += 1
        print(
            f"{seed}: {case}: {share:.0%} {told['verdict']['level']} {told['verdict']['reason']} {off:.2f} mm",
            flush=True,
        )
    print(
        f"{found} of {len(cases)} accepted; of the lines, {np.median(shares):.0%} detected, least {min(shares):.0%}; "
        f"rms on the carpet {np.median(errors):.2f} mm, most {max(errors):.2f} mm; {np.median(works):.2f} s"
    )


if __name__ == "__main__":
    main()
