"""REST of two cameras: the geometry between their pictures, and whether they agree in millimetres."""

import numpy as np
import pytest
from pair_over_field import calibrations, matches
from refusals import API, refusal

from app.exports import EXPORTS

PAIRS = f"{API}/pairs"


@pytest.fixture(scope="module")
def ids(standing):
    """The two cameras' calibrations, kept."""
    def kept(model="brown-conrady"):
        made = [standing.post(f"{API}/calibrations/import", files={"file": EXPORTS["json"].write(calibration)})
                for calibration in calibrations(model)]
        return dict(zip(("calibration_a", "calibration_b"), (answer.json()["id"] for answer in made), strict=True))
    return kept


def judged(client, **body):
    answer = client.post(PAIRS, json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def points(*args, **kwargs):
    return dict(zip(("points_a", "points_b"), matches(*args, **kwargs), strict=True))


def test_matches_alone_tell_the_fundamental_matrix_and_their_mistakes(standing):
    body = points(80, heights_mm=(0, 800), mistakes=10)
    found = judged(standing, **body)
    told = found["fundamental"]
    assert set(range(10)) <= set(told["outliers"]) and len(told["outliers"]) < 16
    assert told["rms_px"] < 0.6 and found["matches"] == 80 and found["failed"] == []
    assert found["pose"] is found["calibrated"] is found["agreement"] is None
    a, b = (np.column_stack([np.array(body[k])[10:], np.ones(70)]) for k in ("points_a", "points_b"))
    lines = a @ np.array(told["matrix"]).T
    away = np.abs((b * lines).sum(axis=1)) / np.hypot(lines[:, 0], lines[:, 1])
    assert np.median(away) < 1


def test_two_calibrations_agree_where_things_on_the_carpet_are_seen_by_both(standing, ids):
    found = judged(standing, **points(), **ids())
    assert found["agreement"]["from"] == "matches" and found["agreement"]["n"] == 60
    assert 0 < found["agreement"]["median_mm"] < 5 and found["agreement"]["overlap_m2"] > 1
    assert found["calibrated"]["median_px"] < 1


def test_a_part_that_cannot_be_had_is_named_and_the_rest_stands(standing, ids):
    found = judged(standing, **points(6), **ids())
    assert found["agreement"]["n"] == 6 and found["calibrated"]["median_px"] < 1
    assert found["fundamental"] is found["pose"] is None
    assert {failed["part"]: failed["reason"] for failed in found["failed"]} == {
        "fundamental": "too-few-points", "pose": "too-few-points"}
    assert all(failed["fix"] for failed in found["failed"])


def test_with_both_lenses_matches_at_heights_tell_the_pose_as_well(standing, ids):
    found = judged(standing, **points(120, heights_mm=(0, 800)), **ids())
    assert found["failed"] == [] and found["pose"]["rotation_sigma_deg"] < 2
    assert found["pose"]["rms_px"] < 0.7 and np.linalg.norm(found["pose"]["direction"]) == pytest.approx(1)


def test_the_height_of_what_is_matched_counts(standing, ids):
    hats = points(heights_mm=(150, 150))
    at_hat, on_carpet = (judged(standing, **hats, **ids(), z_mm=z)["agreement"]["median_mm"] for z in (150, 0))
    assert at_hat < 5 < 50 < on_carpet
    refused = judged(standing, **hats, **ids("polynomial"), z_mm=0)
    assert refused["agreement"]["median_mm"] > 50 and refused["pose"] is None


def test_without_matches_the_lines_that_both_were_clicked_on_are_compared(standing, ids):
    found = judged(standing, **ids())
    assert found["agreement"]["from"] == "clicks" and found["agreement"]["median_mm"] < 5
    assert found["fundamental"] is None and found["matches"] == 0


REFUSED = {
    "nothing": ({}, 422, "nothing-given"),
    "one picture": ({"points_a": [[1, 2]]}, 422, "one-sided"),
    "uneven": ({"points_a": [[1, 2]], "points_b": []}, 422, "bad-matches"),
    "too few": ({"points_a": [[1, 2]] * 3, "points_b": [[1, 2]] * 3}, 422, None),
    "no pairs": ({"points_a": [[1, 2, 3]], "points_b": [[1, 2]]}, 422, None),
    "one calibration": ({"calibration_a": None}, 422, "nothing-given"),
    "an unknown calibration": ({"calibration_a": "nobody", "calibration_b": "nobody"}, 404, "unknown-calibration"),
    "an unknown entry": ({"matches": []}, 422, None),
    "on one line": ({"points_a": [[k, k] for k in range(30)], "points_b": [[k, 2 * k] for k in range(30)]}, 422, None),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_tells_nothing_is_refused_with_its_cure(standing, name):
    body, status, reason = REFUSED[name]
    refusal(standing.post(PAIRS, json=body), status, reason)


def test_one_calibration_twice_and_two_fields_are_refused(standing, ids, clicks):
    both = ids()
    refusal(standing.post(PAIRS, json={"calibration_a": both["calibration_a"]}), 422, "one-sided")
    other = standing.post(f"{API}/calibrations", json=clicks()).json()["id"]
    refusal(standing.post(PAIRS, json={**both, "calibration_b": other}), 409, "different-fields")
