"""Check only: what a calibration is off today is told in mm as it is, and nothing is told that cannot be known."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from app.core.errors import Conflict
from app.core.records import Frame
from app.models import field_from_raw, model_from_json
from app.workflows.automatic_request import AutomaticRequest
from app.workflows.check import check
from tests.support import second_simulator
from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.tiers import long

SPEC = SceneSpec(3, "ssl-div-b", "full", "mild", (640, 534), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 6, 0)


@pytest.fixture(scope="module")
def scene():
    return scene_of(SPEC)


@pytest.fixture(scope="module")
def calibration(scene):
    return _found(scene, "brown-conrady")


def _found(scene, model):
    told, made = AutomaticRequest(scene.field, scene.region, model).answer(Frame(scene.pixels))
    assert made is not None, told["verdict"]
    return made


def knocked(calibration, shift_mm=(0, 0), turn=(0, 0, 0)):
    parameters = json.loads(json.dumps(calibration.model_parameters))
    parameters["position_mm"][:2] = np.add(parameters["position_mm"][:2], shift_mm).tolist()
    parameters["rotation"] = np.add(parameters["rotation"], turn).tolist()
    return replace(calibration, model_parameters=parameters)


def true_mm(calibration, scene):
    """How far off it is over the carpet that is seen: mean and p95."""
    x, y = np.meshgrid(np.linspace(*scene.region.x_mm, 21), np.linspace(*scene.region.y_mm, 15))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    raw = scene.camera.raw_from_field(places)
    seen = scene.camera.sees(raw)
    model = model_from_json(calibration.model_name, calibration.model_parameters)
    off = np.linalg.norm(field_from_raw(model, raw[seen]) - places[seen], axis=1)
    return off.mean(), np.percentile(off, 95)


def test_one_that_holds_is_called_so_line_by_line(calibration, scene):
    found = check(calibration, scene.pixels)
    assert found["verdict"]["level"] == "good" and found["verdict"]["reason"] == "holds"
    assert found["found_share"] > 0.8 and len(found["lines"]) == 13
    seen = [line for line in found["lines"] if line["found"]]
    assert len(seen) >= 11 and all(line["rms_mm"] < 2.0 for line in seen)
    assert found["carpet"]["max_mm"] < 1.5 and found["hat"]["max_mm"] < 1.5


def test_one_that_was_never_right_is_not_said_to_have_moved_and_its_lines_are_as_its_report_has_them(scene):
    coarse = _found(scene, "polynomial")
    found = check(coarse, scene.pixels)
    assert (found["verdict"]["level"], found["verdict"]["reason"]) == ("poor", "as-made")
    own = {f["feature"]: f["rms_mm"] for f in coarse.report["per_feature"]}
    same = [(line["rms_mm"], own[line["feature"]]) for line in found["lines"]
            if line["found_share"] > 0.8 and line["feature"] in own]
    assert len(same) >= 5 and all(told == pytest.approx(made, rel=0.25, abs=1.0) for told, made in same)


@pytest.mark.parametrize("knock", [
    {"shift_mm": (2, 2)}, {"shift_mm": (9, -6)}, long({"shift_mm": (-200, 120)}), long({"turn": (0.002, 0, 0)}),
    {"turn": (0, 0.001, -0.004)}, long({"turn": (0.01, 0.01, 0.0)})])
def test_a_knock_is_told_in_mm_as_far_as_it_is(calibration, scene, knock):
    moved = knocked(calibration, **knock)
    mean, p95 = true_mm(moved, scene)
    found = check(moved, scene.pixels)
    assert found["carpet"]["mean_mm"] == pytest.approx(mean, rel=0.1, abs=0.5)
    assert found["carpet"]["p95_mm"] == pytest.approx(p95, rel=0.1, abs=0.5)
    assert found["verdict"]["level"] == ("good" if p95 < 5 else "fair" if p95 < 15 else "poor")
    assert found["verdict"]["reason"] == ("holds" if p95 < 5 else "moved")


def test_people_and_robots_on_the_lines_cost_lines_and_not_the_figure(calibration):
    hidden = scene_of(replace(SPEC, people=8, robots=12))
    moved = knocked(calibration, shift_mm=(0, 30))
    found = check(moved, hidden.pixels)
    assert hidden.hidden > 0.02 and found["verdict"]["reason"] == "moved"
    assert found["carpet"]["mean_mm"] == pytest.approx(true_mm(moved, hidden)[0], rel=0.1)


def test_a_lens_that_was_changed_is_no_knock(calibration, scene):
    parameters = json.loads(json.dumps(calibration.model_parameters))
    parameters["lens_terms"][0] -= 0.02
    found = check(replace(calibration, model_parameters=parameters), scene.pixels)
    assert found["verdict"]["level"] == "poor" and found["verdict"]["reason"] == "lens"


def unlit(pixels):
    return pixels // 40


def another_field(_):
    return scene_of(replace(SPEC, field="vsss-3v3", height_mm=2000.0)).pixels


def nothing_but_carpet(pixels):
    return np.full_like(pixels, (40, 120, 50))


@pytest.fixture(scope="module")
def in_the_dark(calibration, scene):
    return check(calibration, unlit(scene.pixels))


@pytest.mark.parametrize("picture", [unlit, another_field, nothing_but_carpet])
def test_where_the_lines_are_not_to_be_seen_no_figure_is_given(calibration, scene, in_the_dark, picture):
    found = in_the_dark if picture is unlit else check(calibration, picture(scene.pixels))
    assert found["verdict"]["reason"] in ("not-seen", "elsewhere") and found["verdict"]["fix"]
    assert [found[name] for name in ("rms_mm", "p95_mm", "carpet", "hat")] == [None] * 4
    assert all(line["rms_mm"] is None for line in found["lines"])


def test_a_camera_that_looks_elsewhere_is_told_from_a_field_in_the_dark(calibration, scene, in_the_dark):
    turned = cv2.rotate(scene.pixels, cv2.ROTATE_180)
    turned = np.roll(turned, (150, 170), axis=(0, 1))
    assert check(calibration, turned)["verdict"]["reason"] == "elsewhere"
    assert in_the_dark["verdict"]["reason"] == "not-seen"


def test_a_picture_of_another_size_is_refused(calibration, scene):
    with pytest.raises(Conflict) as refused:
        check(calibration, scene.pixels[:-2])
    assert refused.value.reason == "size-mismatch" and refused.value.fix


@pytest.mark.parametrize(("seed", "smaller"), [(6, {"size": (640, 480)}), (14, {"size": (640, 480)}), long(16, {}),
                                               long(20, {})])
def test_paint_beside_its_place_is_no_moved_camera(seed, smaller):
    """Of the simulator that is not ours, whose lines lie 3 mm off: checked in its own picture, nothing has changed."""
    scene = second_simulator.render(second_simulator.scene_spec(seed, **smaller))
    found = check(_found(scene, "fisheye"), scene.pixels)
    assert found["rms_mm"] < 0.5 and found["p95_mm"] < 1.0
    assert found["verdict"]["level"] == "good"
