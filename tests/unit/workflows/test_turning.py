"""A calibration for pictures that are turned since: every claim of its report is still true of the turned points."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.examples import examples
from tests.support.fields import marks_seen, plain_field, seen
from touchline.core.errors import BadInput
from touchline.core.geometry import with_z
from touchline.core.quarter_turn import QuarterTurn
from touchline.core.records import Calibration, observations_from_json
from touchline.evaluate.residuals import feature_residuals
from touchline.evaluate.uncertainty import expected_error, fit_from_json
from touchline.fitting.ray_camera.lens_prior import read_lens
from touchline.models import Restored, model_of, raw_from_field
from touchline.models.intrinsics import PINHOLE_PARAMETERS, Intrinsics
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.turning import (
    turned_calibration,
    turned_lens,
    turned_lens_option,
    turned_lens_record,
)

TURNS = (90, 180, 270)
every_turn = pytest.mark.parametrize("turn_deg", TURNS)
every_kind = pytest.mark.parametrize(
    "name", ["brown-conrady", "division", "homography", "polynomial"]
)


@cache
def fitted(name: str, index: int = 1) -> Calibration:
    """A calibration of noisy points on borders and inner marks."""
    model = examples(name)[index]
    field, rng = plain_field(model.region), np.random.default_rng(1)
    clicks = (*seen(model, model.region, 9), *marks_seen(model, field))
    noisy = tuple(replace(o, points=o.points + rng.normal(0, 0.3, o.points.shape)) for o in clicks)
    request = CalibrationRequest(
        noisy, field, model.region, model.image_size, name, camera="north", note="by hand"
    )
    return request.record(request.run(cross_validate=False))


def plain(value):
    return json.loads(json.dumps(value, allow_nan=False))


@every_kind
@every_turn
def test_every_residual_is_that_of_the_turned_point(name, turn_deg):
    before = fitted(name)
    after = turned_calibration(before, turn_deg, "About.")
    model, field, region = Restored.of(after)
    rows = after.report["per_feature"]
    for o, row, old in zip(
        observations_from_json(after.observations),
        rows,
        before.report["per_feature"],
        strict=True,
    ):
        found = feature_residuals(model, o, field, region)
        named = {
            name: [r[name] for r in row["residuals"]] for name in ("point", "foot", "px", "mm")
        }
        np.testing.assert_allclose(named["point"], o.points, atol=1e-9)
        np.testing.assert_allclose(np.array(named["foot"], float), found.foot, atol=1e-5)
        np.testing.assert_allclose(np.array(named["px"], float), found.px, atol=1e-6)
        np.testing.assert_allclose(np.array(named["mm"], float), found.mm, atol=1e-5)
        assert row["rms_mm"] == old["rms_mm"]
    assert after.report["rms_mm"] > 0.1 and after.report["verdict"] == before.report["verdict"]


@every_kind
@every_turn
def test_it_says_what_was_done_and_is_read_like_any_other(name, turn_deg):
    before = fitted(name)
    after = turned_calibration(before, turn_deg, "About.")
    assert Calibration.from_json(plain(after.to_json())) == after
    width, height = before.image_size
    assert tuple(after.image_size) == ((height, width) if turn_deg % 180 else (width, height))
    assert after.note == "About. by hand" and (after.snapshot, after.active) == (None, False)
    assert (after.region, after.rotate) == (before.region, before.rotate)
    assert after.corrected_size == before.corrected_size == model_of(after).corrected_size


@pytest.mark.parametrize("name", ["brown-conrady", "division", "homography"])
@every_turn
def test_the_expected_error_is_the_same_everywhere(name, turn_deg):
    before = fitted(name)
    after = turned_calibration(before, turn_deg, "About.")
    z_mm = 0.0 if name == "homography" else 150.0
    first, second = (
        expected_error(
            fit_from_json(one.report["covariance"], model_of(one))[0],
            model_of(one).region,
            z_mm,
        ).sigma_mm
        for one in (before, after)
    )
    assert ("freer" in after.report["covariance"]) == ("freer" in before.report["covariance"])
    np.testing.assert_allclose(second, first, rtol=1e-6)
    assert np.nanmin(first) > 0


@every_turn
def test_a_covariance_of_another_model_is_not_carried_on(turn_deg):
    before = fitted("homography")
    foreign = replace(
        before, report={**before.report, "covariance": fitted("division").report["covariance"]}
    )
    assert turned_calibration(foreign, turn_deg, "").report["covariance"] is None


def test_the_next_best_point_is_proposed_where_it_is_seen_then():
    before = fitted("brown-conrady")
    after = turned_calibration(before, 90, "About.")
    x, y = before.report["next_click"]["point"]
    assert after.report["next_click"]["point"] == pytest.approx(
        [before.image_size.height - 1 - y, x]
    )
    assert after.report["next_click"]["worst_mm"] == before.report["next_click"]["worst_mm"]


@pytest.mark.parametrize("name", ["brown-conrady", "homography"])
@every_turn
def test_a_fit_to_the_turned_points_is_the_turned_fit(name, turn_deg):
    after = turned_calibration(fitted(name), turn_deg, "About.")
    again = CalibrationRequest.of(after, after.options, "").run(cross_validate=False)
    places = np.array([[-1500.0, -1000.0], [0.0, 500.0], [1800.0, 1400.0]])
    np.testing.assert_allclose(
        raw_from_field(again.model, places), raw_from_field(model_of(after), places), atol=0.02
    )
    assert again.report["rms_px"] == pytest.approx(after.report["rms_px"], rel=1e-3)


@every_turn
def test_a_lens_that_was_given_turns_too(turn_deg):
    own = fitted("brown-conrady")
    for option in (
        own.lens_option(),
        {"name": "brown-conrady", "lens": board_lens().to_json()},
    ):
        given = {"lens": {"id": "c0ffee", **option}, "lens_sigma": "own", "terms": ["k1", "p1"]}
        after = turned_calibration(replace(own, options=given), turn_deg, "").options
        assert "id" not in after["lens"] and after["lens_sigma"] == "own"
        assert after["terms"] == (["k1", "p1"] if turn_deg == 180 else ["k1", "p2"])
        before = read_lens("brown-conrady", given, own.image_size)
        turn = QuarterTurn(turn_deg, own.image_size)
        found = read_lens("brown-conrady", after, turn.size_after)
        rays = with_z(np.array([[0.3, -0.2], [-0.4, 0.1], [0.0, 0.4]]), 1.0)
        np.testing.assert_allclose(
            found.project(rays @ turn.about_axis.T), turn.points(before.project(rays)), atol=1e-8
        )
        assert found.sigma["k1"] == pytest.approx(before.sigma["k1"])
        other = "centre_x" if turn_deg == 180 else "centre_y"
        assert found.sigma["centre_x"] == pytest.approx(before.sigma[other])


def board_lens() -> Intrinsics:
    names = (*PINHOLE_PARAMETERS, "k1", "k2", "p1", "p2")
    sigma = np.diag(np.linspace(1e-6, 1e-4, len(names)))
    return Intrinsics(
        "brown-conrady",
        (-0.2, 0.05, 0.001, -0.002, 0.0, 0.0, 0.0, 0.0),
        900.0,
        1.01,
        (630.0, 520.0),
        examples("brown-conrady")[1].image_size,
        names,
        tuple(tuple(map(float, row)) for row in sigma),
    )


def test_the_record_of_a_lens_claims_nothing_of_places_that_are_elsewhere():
    verdict = {"level": "good", "sentence": "Lens model uncertainty: about 0.1 px."}
    lens = board_lens()
    record = {
        "model": lens.model,
        "lens": lens.to_json(),
        "board": {"columns": 9},
        "image_size": list(lens.image_size),
        "snapshots": ["c0ffee"],
        "report": {
            "rms_px": 0.2,
            "views": [{"name": "a"}],
            "warnings": [{}],
            "coverage": {"cells": [[1]]},
            "verdict": verdict,
        },
    }
    after = turned_lens_record(record, 270)
    assert after["lens"] == plain(lens.turned(270).to_json())
    assert after["image_size"] == [1024, 1280] and after["snapshots"] is None
    assert after["report"] == {"rms_px": 0.2, "verdict": verdict, "views": [], "warnings": []}
    assert "turned by 90° counter-clockwise" in after["note"]


def test_what_is_no_lens_is_refused():
    for value in (None, {}, {"unit": "half-diagonal"}):
        with pytest.raises(BadInput):
            turned_lens(value, 90)
    assert "covariance" not in turned_lens_option(
        {"name": "division", "parameters": fitted("division").model_parameters}, 90
    )
