"""The entered camera height against the points: where they contradict, nothing is called good."""

from functools import cache

import numpy as np
import pytest

from tests.support.height_scenes import POINTS, HeightScene, height_scene
from tests.support.operator import FIELD, REGION, SIZE, reference_camera, true_camera
from tests.support.sim_clicks import border_observations
from touchline.core.field import BORDERS
from touchline.core.records import Observation
from touchline.models import parameters_json
from touchline.store.fields import load_fields
from touchline.workflows.calibration import calibrate

TOPS_MM = load_fields()["ssl-div-b"].hat_height_mm


@cache
def seen(view: str, points: str) -> HeightScene:
    tilt_deg = {"oblique": 30.0, "from above": 3.0}[view]
    return height_scene(4, view, points, lens="machine-3.5mm", height_mm=4500.0, tilt_deg=tilt_deg)


def reported(scene: HeightScene, **options):
    """Return the model and the report, quickly: without points left out."""
    done = calibrate(
        scene.observations,
        scene.field,
        scene.region,
        scene.image_size,
        scene.model,
        options,
        cross_validate=False,
    )
    return done.model, done.report


def reasons(report) -> set[str]:
    return {warning["reason"] for warning in report["warnings"]}


@pytest.mark.parametrize("points", POINTS)
def test_a_height_that_the_points_contradict_is_told_and_nothing_is_good(points):
    scene = seen("oblique", points)
    model, report = reported(scene, **scene.height_option(0.8))
    height, verdict = report["height"], report["verdict"]
    assert height["state"] == "contradicted" and height["sigmas"] > 3
    assert (
        abs(height["points_mm"] - scene.height_mm)
        < 3 * height["points_sigma_mm"]
        < 0.1 * scene.height_mm
    )
    [warning] = [w for w in report["warnings"] if w["reason"] == "height-contradicted"]
    assert f"{0.8 * scene.height_mm / 1000:.2f} m was entered" in warning["text"]
    assert verdict["level"] == "poor" and warning["text"] in verdict["sentence"]
    true_mm, told_mm = scene.error_mm(model, TOPS_MM), report["sigma_mm"]["hat"]["rms"]
    assert true_mm > 10 and true_mm / 3 < told_mm < 3 * true_mm
    # so does the error map that is drawn from the report later
    assert report["covariance"]["freer"]["parameters"]["position_mm"][2] == pytest.approx(
        height["points_mm"]
    )


def test_a_height_by_tape_agrees_with_the_points():
    scene = seen("oblique", "clicks")
    _, report = reported(scene, **scene.height_option(off_mm=20.0))
    height = report["height"]
    assert (height["state"], height["entered_mm"]) == (
        "agrees",
        pytest.approx(scene.height_mm + 20),
    )
    assert height["sigmas"] < 3 and "height-contradicted" not in reasons(report)
    assert report["verdict"]["level"] != "poor" and "freer" not in report["covariance"]


def test_straight_down_the_points_cannot_check_it_and_the_verdict_says_so():
    scene = seen("from above", "clicks")
    _, report = reported(scene, **scene.height_option(0.9))
    assert report["height"]["state"] == "not-checked"
    assert "the points cannot check" in report["verdict"]["sentence"]


def test_without_one_it_is_an_estimate():
    scene = seen("oblique", "clicks")
    model, report = reported(scene)
    height = report["height"]
    assert (height["state"], height["entered_mm"], height["sigmas"]) == ("estimated", None, None)
    assert (
        height["points_mm"] == pytest.approx(model.position_mm[2]) and height["points_sigma_mm"] > 0
    )


@pytest.mark.parametrize(("larger", "state"), [(1.0, "agrees"), (1.04, "contradicted")])
def test_a_field_of_another_size_contradicts_a_right_tape_where_the_lens_is_known(larger, state):
    """The tape is overruled, so what is told is how far positions are off if it is right."""
    camera = reference_camera("mild", 4.0)
    true = true_camera(camera)
    lens = {"lens": {"name": true.NAME, "parameters": parameters_json(true)}, "lens_sigma": "0"}
    # a field so much larger, seen from as much higher, gives the same picture
    tape = {"height_mm": {"value": larger * camera.position_mm[2], "sigma": 30.0}}
    clicks = border_observations(camera, REGION, 9, 0.3, np.random.default_rng(1), anywhere=True)
    report = calibrate(
        clicks, FIELD, REGION, SIZE, true.NAME, lens | tape, cross_validate=False
    ).report
    assert report["height"]["state"] == state
    assert (report["verdict"]["level"] == "poor") == (state == "contradicted")
    if larger > 1:
        places = np.array([REGION.border(name).start for name in BORDERS])
        assert 0.5 < report["verdict"]["mm"] / ((larger - 1) * np.hypot(*places.T).mean()) < 1


def test_points_of_another_marking_do_not_hide_behind_a_wrong_height():
    """Outliers are found again without the height: with it, good points were among them."""
    scene = seen("oblique", "clicks")
    wrong = Observation(
        scene.observations[0].feature,
        "line",
        scene.observations[0].points[:1] + np.array([0.0, 40.0]),
    )
    scene = HeightScene(scene.camera, scene.field, scene.region, (*scene.observations, wrong))
    _, report = reported(scene, **scene.height_option(1.4))
    assert report["height"]["state"] == "contradicted"
    assert abs(report["height"]["points_mm"] - scene.height_mm) < 0.1 * scene.height_mm
