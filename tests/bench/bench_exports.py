"""What the league's one-term lens costs. Command: python tests/bench/bench_exports.py

A Division B field from 6.5 m, 1224 × 1024 px, the focal length such that the field just fits in; each camera exported
as ssl-vision, read back, and held against what it was on the carpet and at hat height. Beside it, two ways that tools
go: OpenCV's k1 sent as a = -k1 with nothing else changed, and k1 sent unchanged.
"""

import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.support.exported import of_model
from touchline.core.geometry import ImageSize
from touchline.evaluate.approximation import approximation_error
from touchline.models.ray_camera import BrownConrady, Ssl
from touchline.models.rotation import vector_from_matrix
from touchline.store.fields import load_fields
from touchline.workflows import interchange

FIELD = load_fields()["ssl-div-b"]
SIZE = ImageSize(1224, 1024)
LENSES = {"mild": (-0.06, 0.005), "strong": (-0.28, 0.09), "pincushion": (0.10, 0.02)}
EDGE_PX = 12.0


def camera(lens: str, tilt_deg: float, height_mm: float = 6500.0) -> BrownConrady:
    tilt = np.radians(tilt_deg)
    down = np.diag([1.0, -1.0, -1.0])
    turned = (
        np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
        @ down
    )
    k1, k2 = LENSES[lens]
    region = FIELD.region("full")
    made = BrownConrady(
        lens_terms=(k1, k2, 0, 0, 0, 0, 0, 0),
        focal_px=900.0,
        aspect=1.0,
        centre_px=SIZE.centre,
        rotation=tuple(map(float, vector_from_matrix(turned))),
        width_px=1223.0,
        height_px=815.0,
        position_mm=(0.0, float(height_mm * np.tan(tilt)), height_mm),
        n_rectangles_x=10,
        n_rectangles_y=7,
        region=region,
        image_size=SIZE,
    )
    corners = np.array(
        [[x, y, 0.0] for x in np.linspace(-4500, 4500, 41) for y in np.linspace(-3000, 3000, 41)]
    )
    reach = np.abs(made.project(corners) - np.array(SIZE.centre)).max(axis=0)
    return replace(made, focal_px=float(900 * ((np.array(SIZE.centre) - EDGE_PX) / reach).min()))


def costs(lens: str, tilt_deg: float) -> list[float]:
    """Worst and rms on the carpet, worst and rms at hat height; then the worst of a = -k1 and of a = k1, mm."""
    model = camera(lens, tilt_deg)
    made = replace(of_model(model), field=FIELD.to_json(), region="full", rotate=0)
    loss = interchange.export(made, "ssl-vision", approximate=True).loss
    naive = []
    for sign in (-1, 1):
        plain = Ssl(
            **{f.name: getattr(model, f.name) for f in fields(Ssl) if f.name != "lens_terms"},
            lens_terms=(sign * LENSES[lens][0],),
        )
        naive.append(approximation_error(model, plain, model.region, FIELD.hat_height_mm).worst_mm)
    return [loss.worst_mm, loss.rms_mm, loss.hat_worst_mm, loss.hat_rms_mm, *naive]


def test_the_nearest_one_term_lens_beats_a_term_that_is_only_renamed():
    for lens in LENSES:
        for tilt in (0, 12, 30):
            fitted, rms, _, _, renamed, unchanged = costs(lens, tilt)
            assert rms < fitted < renamed / 2 and renamed < unchanged


if __name__ == "__main__":
    print(
        "| lens | tilt | worst, rms on the carpet | worst, rms at 150 mm | worst with a = -k1 | worst with a = k1 |"
    )
    for lens in LENSES:
        for tilt in (0, 12, 30):
            c = costs(lens, tilt)
            print(
                f"| {lens} | {tilt}° | {c[0]:.2f}, {c[1]:.2f} mm | {c[2]:.2f}, {c[3]:.2f} mm | {c[4]:.0f} mm | "
                f"{c[5]:.0f} mm |"
            )
