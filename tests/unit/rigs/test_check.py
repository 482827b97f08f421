"""Cameras that agree can be wrong alike: a rig and a pair are no better than what is known of each camera."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.pair_over_field import matches
from tests.support.rig_over_field import sim_rig, sim_source, with_member
from touchline.core.geometry import with_z
from touchline.rigs.check import check, evaluate_pair, run_check
from touchline.rigs.rig import Rig, RigMember


@pytest.fixture(scope="module")
def by_borders():
    """The paper's method on borders alone, behind lenses that bend the inside by centimetres."""
    return sim_rig(2, model="polynomial", cross_validate=True)


@pytest.fixture(scope="module")
def pictures():
    return {f"cam{n}": sim_source(2, n).rendering.frame(3) for n in range(2)}


def judged(rig, level):
    """The rig, its calibrations' own reports with another level."""
    made = []
    for camera in rig.cameras:
        report = {
            **camera.calibration.report,
            "verdict": {**camera.calibration.report["verdict"], "level": level},
        }
        made.append(replace(camera, calibration=replace(camera.calibration, report=report)))
    return replace(rig, cameras=tuple(made))


@pytest.mark.parametrize(
    ("own", "best", "reason"),
    [("unknown", "fair", "accuracy-unknown"), ("poor", "poor", "not-accurate")],
)
def test_a_rig_whose_cameras_agree_by_their_clicks_is_no_better_than_their_own_reports(
    by_borders, own, best, reason
):
    found = check(judged(by_borders, own), {})
    (pair,) = found["pairs"]
    assert pair["from"] == "clicks" and pair["verdict"]["level"] == "good"
    assert found["verdict"]["level"] == best and "Camera 0" in found["verdict"]["sentence"]
    assert {t["reason"] for camera in found["cameras"] for t in camera["troubles"]} == {reason}


def test_with_pictures_it_is_poor_and_says_whose_lines_are_elsewhere(by_borders, pictures):
    found = check(by_borders, pictures)
    assert found["verdict"]["level"] == "poor"
    told = [
        t
        for camera in found["cameras"]
        for t in camera["troubles"]
        if t["reason"] == "lines-misplaced"
    ]
    assert told and all("Largest error" in t["text"] and t["fix"] for t in told)


def test_cameras_with_a_lens_that_fits_keep_their_verdict(pictures):
    found = check(sim_rig(2, cross_validate=True), pictures)
    assert found["verdict"]["level"] == found["pairs"][0]["verdict"]["level"]
    assert not [
        t
        for camera in found["cameras"]
        for t in camera["troubles"]
        if t["reason"] == "lines-misplaced"
    ]


def test_a_pair_is_no_better_than_its_calibrations(by_borders):
    a, b = (camera.calibration for camera in by_borders.cameras)
    verdict = evaluate_pair(None, None, a, b)["agreement"]["verdict"]
    assert verdict["level"] == "poor" and "cam0" in verdict["sentence"] and "cam1" in verdict["fix"]


def test_a_rig_of_one_camera_and_one_that_nobody_could_compare_agree_with_nothing(by_borders):
    alone = replace(by_borders, cameras=by_borders.cameras[:1])
    verdict = check(alone, {})["verdict"]
    assert verdict["level"] is None and verdict["reason"] == "single-camera" and verdict["fix"]
    verdict = check(with_member(by_borders, 1, calibration=None), {})["verdict"]
    assert verdict["level"] is None and verdict["reason"] == "nothing-compared" and verdict["fix"]


def test_a_rig_is_no_better_than_fair_while_a_camera_is_compared_with_no_other(by_borders):
    rig = judged(by_borders, "good")
    assert check(rig, {})["verdict"]["level"] == "good"
    rig = replace(rig, cameras=(*rig.cameras, RigMember("cam9", "Camera 9")))
    verdict = check(rig, {})["verdict"]
    assert (
        verdict["level"] == "fair"
        and verdict["reason"] is None
        and "Camera 9" in verdict["sentence"]
    )


def test_a_rig_comes_back_from_what_a_job_is_given(by_borders):
    text = json.dumps(by_borders.to_json())
    again = Rig.from_json(json.loads(text))
    assert json.dumps(again.to_json()) == text and again.titles == by_borders.titles
    found = run_check({"rig": json.loads(text), "missing": [], "matches": []}, lambda *_: None)
    assert found["verdict"] == check(by_borders, {})["verdict"] and found["missing"] == []


def test_matches_without_a_height_show_the_geometry_and_the_clicks_the_agreement(by_borders):
    points_a, points_b = matches(40, heights_mm=(0, 800))
    given = {
        "a": "cam1",
        "b": "cam0",
        "points_a": points_b,
        "points_b": points_a,
        "z_mm": [None] * 40,
    }
    (pair,) = check(by_borders, {}, [given])["pairs"]
    assert pair["from"] == "clicks" and pair["verdict"]["level"] == "good"
    assert (
        pair["matches"]["fundamental"]["rms_px"] < 1
        and pair["matches"]["agreement"]["from"] == "clicks"
    )


def test_a_few_matches_add_to_the_lines_of_the_pictures(pictures):
    rig = sim_rig(2)
    places = with_z(np.array([[0.0, -1800.0], [40.0, 300.0], [-60.0, 2100.0], [90.0, 900.0]]), 0.0)
    points = [sim_source(2, number).camera.raw_from_field(places) for number in range(2)]
    points[1][2] += 40.0  # a mistake
    given = {
        "a": "cam0",
        "b": "cam1",
        "points_a": points[0].tolist(),
        "points_b": points[1].tolist(),
        "z_mm": [0.0, 0.0, 0.0, None],
    }
    (by_lines,), (both,) = check(rig, pictures)["pairs"], check(rig, pictures, [given])["pairs"]
    assert both["from"] == "matches" and both["agreement"]["n"] == by_lines["agreement"]["n"] + 6
    assert both["agreement"]["carpet"]["p95_mm"] == pytest.approx(
        by_lines["agreement"]["carpet"]["p95_mm"], abs=2
    )
    assert (
        both["agreement"]["outliers"] == [2]
        and "1 of 3 is an outlier" in both["verdict"]["sentence"]
    )
    assert both["matches"]["agreement"]["n"] == 3
    apart_mm = both["matches"]["agreement"]["apart_mm"]
    assert len(apart_mm) == 4 and max(apart_mm[:2]) < 10 < 50 < apart_mm[2] and apart_mm[3] is None
