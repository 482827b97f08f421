"""Lenses that Touchline has not, as the nearest fisheye: held against their own formulas, to the error that is said."""

import json
import re

import numpy as np
import pytest

from touchline.core.errors import BadInput
from touchline.workflows import interchange

KALIBR = """cam0:
  camera_model: {model}
  intrinsics: [{parameters}350, 351, 640, 480]
  distortion_model: {distortion}
  distortion_coeffs: [{terms}]
  resolution: [1280, 960]
"""
MEI = """%YAML:1.0
---
model_type: MEI
camera_name: c
image_width: 1280
image_height: 960
mirror_parameters: {xi: 0.9}
distortion_parameters: {k1: -0.05, k2: 0.01, p1: 0.0, p2: 0.0}
projection_parameters: {gamma1: 350, gamma2: 351, u0: 640, v0: 480}
"""


def omni(ray, xi, k1=0.0, k2=0.0):
    x, y, z = ray.T
    x, y = x / (z + xi), y / (z + xi)
    r2 = x**2 + y**2
    return np.stack([x, y]) * (1 + k1 * r2 + k2 * r2**2)


def double_sphere(ray, xi, alpha):
    x, y, z = ray.T
    d1 = np.sqrt(x**2 + y**2 + z**2)
    d2 = np.sqrt(x**2 + y**2 + (xi * d1 + z) ** 2)
    return np.stack([x, y]) / (alpha * d2 + (1 - alpha) * (xi * d1 + z))


def extended_unified(ray, alpha, beta):
    x, y, z = ray.T
    return np.stack([x, y]) / (alpha * np.sqrt(beta * (x**2 + y**2) + z**2) + (1 - alpha) * z)


def field_of_view(ray, w):
    x, y = ray.T[:2] / ray.T[2]
    r = np.hypot(x, y)
    return np.stack([x, y]) * np.arctan(2 * r * np.tan(w / 2)) / (w * r)


def stereographic(ray):
    x, y, z = ray.T
    return 2 * np.stack([x, y]) / (1 + z)


def kalibr(model, parameters="", distortion="none", terms=""):
    return KALIBR.format(model=model, parameters=parameters, distortion=distortion, terms=terms)


LENSES = {
    "Kalibr omni": (
        kalibr("omni", "0.8, ", "radtan", "-0.05, 0.01, 0.0, 0.0"),
        omni,
        (0.8, -0.05, 0.01),
    ),
    "Kalibr double sphere": (kalibr("ds", "-0.2, 0.58, "), double_sphere, (-0.2, 0.58)),
    "Kalibr extended unified": (kalibr("eucm", "0.6, 1.1, "), extended_unified, (0.6, 1.1)),
    "Kalibr field of view": (
        kalibr("pinhole", distortion="fov", terms="0.9"),
        field_of_view,
        (0.9,),
    ),
    "VINS MEI": (MEI, omni, (0.9, -0.05, 0.01)),
    "mrcal stereographic": (
        "{'lensmodel': 'LENSMODEL_STEREOGRAPHIC', 'intrinsics': (350, 351, 640, 480),\n"
        " 'imagersize': (1280, 960), 'rt_cam_ref': (0, 0, 0, 0, 0, 0)}",
        stereographic,
        (),
    ),
    "PhotonVision in its spelling": (
        json.dumps(
            {
                "resolution": {"width": 1280, "height": 960},
                "cameraIntrinsics": {
                    "rows": 3,
                    "cols": 3,
                    "data": [350, 0, 640, 0, 351, 480, 0, 0, 1],
                },
                "distCoeffs": {"rows": 1, "cols": 0, "data": []},
                "lensmodel": "LENSMODEL_STERIOGRAPHIC",
            }
        ),
        stereographic,
        (),
    ),
    "Basalt double sphere": (
        json.dumps(
            {
                "width": 1280,
                "height": 960,
                "camera_type": "ds",
                "fx": 350,
                "fy": 351,
                "cx": 640,
                "cy": 480,
                "xi": -0.2,
                "alpha": 0.58,
            }
        ),
        double_sphere,
        (-0.2, 0.58),
    ),
}


@pytest.mark.parametrize("name", LENSES)
def test_a_lens_is_read_as_the_nearest_fisheye_to_the_error_that_is_said(name):
    text, formula, parameters = LENSES[name]
    found = interchange.read_file(text.encode())
    said_px = float(re.search(r"nearest fisheye, to ([0-9.e-]+) px", " ".join(found.notes))[1])
    assert found.model == "fisheye" and 0 < said_px < 0.5
    angle, round_ = np.meshgrid(np.radians(np.linspace(1, 80, 40)), np.linspace(0, 6, 9))
    rays = np.stack(
        [np.sin(angle) * np.cos(round_), np.sin(angle) * np.sin(round_), np.cos(angle)], -1
    ).reshape(-1, 3)
    wanted = formula(rays, *parameters).T * (350, 351) + (640, 480)
    inside = ((wanted > 0) & (wanted < (1280, 960))).all(axis=1)
    assert inside.sum() > 100
    off_px = np.abs(found.lens().project(rays[inside]) - wanted[inside]).max()
    assert off_px <= said_px * 1.05 + 1e-3


def test_a_lens_that_is_not_known_to_be_round_is_refused():
    text = kalibr("omni", "0.8, ", "radtan", "-0.05, 0.01, 0.001, 0.0")
    with pytest.raises(BadInput, match="coefficients that no fisheye has"):
        interchange.read_file(text.encode())


@pytest.mark.parametrize(
    "text, match",
    [
        (kalibr("ds", "-0.2, 1.58, "), "alpha is 1.58"),
        (kalibr("ds", "-0.2, "), "intrinsics has 5 numbers"),
        (kalibr("omni"), "no xi"),
        (kalibr("omni", "0.8, ", "equidistant", "0.1, 0.01, 0, 0"), "two lenses"),
        (MEI.replace("xi: 0.9", "xi: 0.9, skew: 1"), "skew is not read"),
        (kalibr("eucm", "0.6, -1, "), "beta is -1"),
        (kalibr("pinhole", distortion="fov", terms="9"), "w is 9"),
        (kalibr("omni", "0.8, ", "radtan", "-0.9, 2.2, 0.0, 0.0"), "the nearest differs by"),
    ],
)
def test_numbers_that_are_no_lens_are_refused_by_name(text, match):
    with pytest.raises(BadInput, match=match):
        interchange.read_file(text.encode())


def test_without_an_image_size_it_is_near_over_less():
    text = kalibr("ds", "-0.2, 0.58, ").replace("  resolution: [1280, 960]\n", "")
    found = interchange.read_file(text.encode())
    assert found.image_size is None and "nearest fisheye" in found.notes[0]
    assert "compared up to 75° from the axis" in found.notes[1]


def test_a_lens_that_ends_inside_the_image_says_how_far_it_was_compared():
    text = kalibr("omni", "0.8, ", "radtan", "-0.2, 0.0, 0.0, 0.0")
    assert "compared up to" in interchange.read_file(text.encode()).notes[1]
