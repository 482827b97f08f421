"""What no camera makes is named, caps the verdict, and is counted into the error that is told."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.height_scenes import height_scene
from tests.support.operator import FIELD, REGION, SIZE, reference_camera, true_camera
from tests.support.paths import ROOT
from tests.support.sim_clicks import border_observations
from touchline.core.geometry import ImageSize
from touchline.core.records import observations_from_json
from touchline.fitting.ray_camera.camera_prior import residual_warnings
from touchline.models import parameters_json
from touchline.store.fields import load_fields
from touchline.workflows.calibration import calibrate

TOPS_MM = 150.0


def reasons(report) -> set[str]:
    return {warning["reason"] for warning in report["warnings"]}


@pytest.mark.parametrize("lens", ["strong", "mild"])
def test_the_lens_of_another_camera_does_not_fit_the_points(lens):
    own, other = reference_camera("strong", 8), true_camera(reference_camera(lens))
    clicks = border_observations(own, REGION, 9, 0.3, np.random.default_rng(2), anywhere=True)
    report = calibrate(
        clicks,
        FIELD,
        REGION,
        SIZE,
        other.NAME,
        {"lens": {"name": other.NAME, "parameters": parameters_json(other)}, "lens_sigma": "0"},
        cross_validate=False,
    ).report
    assert ("residuals-too-large" in reasons(report)) == (lens == "mild")
    assert (report["verdict"]["level"] == "poor") == (lens == "mild")


@pytest.mark.parametrize(
    ("click_sigma_px", "width", "rms_px", "warned"),
    [
        (None, 1280, 2.0, False),
        (None, 1280, 2.2, True),
        (None, 640, 1.6, True),
        (None, 640, 1.4, False),
        (2.0, 1280, 5.9, False),
        (2.0, 1280, 6.1, True),
        (0.01, 1280, 1.4, False),
    ],
)
def test_residuals_are_held_against_what_clicks_are_like(click_sigma_px, width, rms_px, warned):
    """And not against σ as estimated from themselves, which grows with any misfit."""
    found = residual_warnings(
        rms_px, {"click_sigma_px": click_sigma_px}, ImageSize(width, 3 * width // 4)
    )
    assert [w.reason for w in found] == ["residuals-too-large"] * warned


@pytest.mark.parametrize("name", ["ssl_2008_half", "unball_full"])
def test_an_operator_s_clicks_on_a_real_picture_are_near_enough(name):
    task = json.loads((ROOT / "tests" / "clicks" / f"{name}.json").read_text())
    field = load_fields()[task["field"]]
    report = calibrate(
        observations_from_json(task["observations"]),
        field,
        field.region(task["region"]),
        ImageSize(*task["image_size"]),
        "division",
        cross_validate=False,
    ).report
    assert "residuals-too-large" not in reasons(report)


def test_a_stretched_picture_is_not_called_good_and_its_error_at_robot_tops_is_told():
    """Held nearly square, height, tilt and lens make up for it with residuals of a third of a pixel."""
    scene = height_scene(
        3, "oblique", "detected", lens="kitti-cam0", height_mm=5500.0, tilt_deg=25.0
    )
    centre, wide = np.array(scene.image_size.centre), np.array([1.05, 1.0])

    def stretched(points):
        return (points - centre) * wide + centre

    seen = tuple(
        replace(o, points=stretched(o.points)[scene.camera.inside(stretched(o.points))])
        for o in scene.observations
    )
    done = calibrate(
        seen, scene.field, scene.region, scene.image_size, scene.model, cross_validate=False
    )
    assert "unusual-aspect" in reasons(done.report) and done.report["rms_px"] < 1
    assert done.report["verdict"]["level"] != "good"
    x, y = np.meshgrid(np.linspace(*scene.region.x_mm, 13), np.linspace(*scene.region.y_mm, 11))
    tops = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, TOPS_MM)])
    pixels = scene.camera.project(tops)
    inside = scene.camera.inside(pixels)
    off = done.model.unproject(stretched(pixels[inside]), TOPS_MM) - tops[inside, :2]
    true_mm = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    assert true_mm > 10 and done.report["sigma_mm"]["hat"]["rms"] > true_mm / 2
