"""A field taped otherwise than the rules have it, recovered from tape distances and from a calibration's offsets."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.tape import SIDES_AND_DIAGONALS, measured
from tests.support.taped_field import calibrated_on, worst_mm
from touchline.core.errors import BadInput, Conflict
from touchline.fields.measuring import JoinedField, TapeDistance, adjust_to_tape, as_found
from touchline.store.fields import load_fields
from touchline.workflows.calibration_request import CalibrationRequest

FIELD = load_fields()["ssl-div-b"]
TAPED = (
    {"goal-line-right": (-15.0, -15.0)},
    {"touch-line-top": (15.0, 15.0), "goal-line-left": (-15.0, -15.0)},
    {"halfway-line": (15.0, 15.0)},
)
GOOD_MM = 3.0


@pytest.mark.parametrize("shifts", TAPED, ids=" ".join)
@pytest.mark.parametrize("seed", range(3))
def test_lines_taped_elsewhere_are_recovered_from_tape_distances(shifts, seed):
    truth = JoinedField(FIELD).moved(shifts, {})
    distances = [
        TapeDistance(*one) for one in measured(truth, SIDES_AND_DIAGONALS, noise_mm=1.0, seed=seed)
    ]
    found = adjust_to_tape(FIELD, distances)
    assert worst_mm(found.field, truth) < GOOD_MM
    assert worst_mm(FIELD, truth) == 15.0
    for name, (mm, sigma) in found.offsets.items():
        assert abs(mm - shifts.get(name, (0.0, 0.0))[0]) < 3 * sigma, name
    assert np.abs(found.residuals_mm).max() < 4
    assert found.field.line_sigma_mm <= FIELD.line_sigma_mm
    assert found.warnings == ()


def test_a_distance_that_was_mistyped_is_left_with_what_is_wrong_of_it():
    distances = [TapeDistance(*one) for one in measured(FIELD, SIDES_AND_DIAGONALS)]
    wrong = TapeDistance(distances[4].start, distances[4].end, distances[4].mm + 500.0)
    found = adjust_to_tape(FIELD, [*distances[:4], wrong, *distances[5:]])
    assert int(np.argmax(np.abs(found.residuals_mm))) == 4 and found.residuals_mm[4] > 100
    assert ("distance-contradicted", 4) in {(w.reason, w.index) for w in found.warnings}


def test_a_single_wrong_distance_moves_lines_by_no_more_than_is_known_of_it_and_is_told():
    """It leaves no residual at all: 9.9 m where 9 are."""
    found = adjust_to_tape(FIELD, [TapeDistance("corner-top-left", "corner-top-right", 9900.0)])
    assert abs(found.residuals_mm[0]) < 1
    assert {w.reason for w in found.warnings} == {"uncertain-move"}
    assert {w.feature for w in found.warnings} >= {"goal-line-left", "goal-line-right"}
    assert (
        found.to_json()["warnings"][0]["statements"]["text"][0]["code"] == "warning.uncertain-move"
    )


def test_one_wrong_distance_of_six_is_named_by_its_residual():
    distances = [TapeDistance(*one) for one in measured(FIELD, SIDES_AND_DIAGONALS[:6])]
    found = adjust_to_tape(
        FIELD, [replace(distances[0], mm=distances[0].mm + 90.0), *distances[1:]]
    )
    assert ("distance-contradicted", 0) in {(w.reason, w.index) for w in found.warnings}


def test_a_line_that_surely_lies_far_from_its_place_is_told():
    truth = JoinedField(FIELD).moved({"goal-line-right": (-60.0, -60.0)}, {})
    found = adjust_to_tape(
        FIELD, [TapeDistance(*one) for one in measured(truth, SIDES_AND_DIAGONALS)]
    )
    assert [(w.reason, w.feature) for w in found.warnings] == [("large-move", "goal-line-right")]


def test_what_names_no_landmark_is_refused():
    with pytest.raises(BadInput) as refused:
        adjust_to_tape(FIELD, [TapeDistance("corner-top-left", "moon", 1.0)])
    assert refused.value.details["entry"] == "distances[0].to"
    with pytest.raises(BadInput):
        adjust_to_tape(FIELD, [TapeDistance("centre", "centre", 1.0)])


@pytest.fixture(scope="module", params=TAPED, ids=" ".join)
def calibrated(request):
    """A camera calibrated by the rules' field, from points on lines that lie elsewhere; and the field as it is."""
    truth = JoinedField(FIELD).moved(request.param, {})
    return calibrated_on(FIELD, truth), truth


def test_they_are_recovered_from_what_a_calibration_has_found(calibrated):
    calibration, truth = calibrated
    found = as_found(calibration, FIELD)
    assert worst_mm(found.field, truth) < GOOD_MM
    assert all(0 < sigma < 5 for _, sigma in found.offsets.values())
    assert found.field.line_sigma_mm < FIELD.line_sigma_mm


def test_offsets_that_nobody_can_mean_are_refused(calibrated):
    calibration, _ = calibrated
    report = {**calibration.report, "line_offsets_mm": {"top": 1e300, "halfway-line": -1e9}}
    with pytest.raises(BadInput) as refused:
        as_found(replace(calibration, report=report), FIELD)
    assert refused.value.reason == "bad-measures"


def test_a_calibration_of_another_content_or_without_offsets_has_nothing_to_adopt(calibrated):
    calibration, truth = calibrated
    with pytest.raises(Conflict) as refused:
        as_found(calibration, truth)
    assert refused.value.reason == "field-changed"
    task = CalibrationRequest.of(calibration, {}, "")
    flat = CalibrationRequest(
        task.observations, FIELD, FIELD.region("full"), task.image_size, "polynomial"
    )
    with pytest.raises(Conflict) as refused:
        as_found(flat.record(flat.run(cross_validate=False)), FIELD)
    assert refused.value.reason == "no-offsets"
