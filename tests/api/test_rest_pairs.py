"""REST of two cameras: the geometry between their pictures, and whether they agree in millimetres."""

from functools import cache

import numpy as np
import pytest

from tests.support.pair_over_field import calibrations, cameras, matches
from tests.support.refusals import API, refusal
from touchline.formats import FORMATS

PAIRS = f"{API}/pairs"


@pytest.fixture(scope="module")
def ids(standing):
    """The two cameras' calibrations, kept."""

    @cache
    def kept(model="brown-conrady"):
        made = [
            standing.post(
                f"{API}/calibrations/import", files={"file": FORMATS["json"].write(calibration)}
            )
            for calibration in calibrations(model)
        ]
        return dict(
            zip(
                ("calibration_a", "calibration_b"),
                (answer.json()["id"] for answer in made),
                strict=True,
            )
        )

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
    assert found["calibrated"] is found["agreement"] is None and "pose" not in found
    a, b = (
        np.column_stack([np.array(body[k])[10:], np.ones(70)]) for k in ("points_a", "points_b")
    )
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
    assert found["fundamental"] is None
    assert {failed["part"]: failed["reason"] for failed in found["failed"]} == {
        "fundamental": "too-few-points"
    }
    assert all(failed["fix"] for failed in found["failed"])


def test_the_height_of_what_is_matched_counts(standing, ids):
    hats = points(heights_mm=(150, 150))
    at_hat, on_carpet = (
        judged(standing, **hats, **ids(), z_mm=z)["agreement"]["median_mm"] for z in (150, 0)
    )
    assert at_hat < 5 < 50 < on_carpet
    refused = judged(standing, **hats, **ids("polynomial"), z_mm=0)
    assert refused["agreement"]["median_mm"] > 50 and refused["calibrated"] is None


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
    "an unknown calibration": (
        {"calibration_a": "nobody", "calibration_b": "nobody"},
        404,
        "unknown-calibration",
    ),
    "an unknown entry": ({"matches": []}, 422, None),
    "on one line": (
        {"points_a": [[k, k] for k in range(30)], "points_b": [[k, 2 * k] for k in range(30)]},
        422,
        None,
    ),
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


def test_every_part_has_its_sentence_and_the_pose_is_in_degrees_and_mm(standing, ids):
    found = judged(standing, **points(120, heights_mm=(0, 800)), **ids(), z_mm=[None] * 120)
    one, other = cameras()
    truth = float(np.linalg.norm(np.array(one.position_mm) - other.position_mm))
    assert found["calibrated"]["distance_mm"] == pytest.approx(truth, rel=0.01)
    assert np.linalg.norm(found["calibrated"]["translation_mm"]) == pytest.approx(
        found["calibrated"]["distance_mm"]
    )
    assert found["calibrated"]["angle_deg"] == pytest.approx(
        np.linalg.norm(found["calibrated"]["rotation_deg"])
    )
    assert all(
        found[part]["verdict"]["level"] in ("good", "fair", "poor")
        and found[part]["verdict"]["sentence"]
        for part in ("fundamental", "calibrated", "agreement")
    )


def test_each_match_has_its_own_height_and_none_where_it_is_not_known(standing, ids):
    carpet, hats = points(20), points(20, heights_mm=(150, 150))
    body = {side: carpet[side] + hats[side] for side in carpet}
    told = judged(standing, **body, **ids(), z_mm=[0] * 20 + [150] * 20)["agreement"]
    assert told["n"] == 40 and max(told["apart_mm"]) < 15
    told = judged(standing, **body, **ids(), z_mm=[0] * 20 + [None] * 20)["agreement"]
    assert (
        told["n"] == 20
        and told["apart_mm"][20:] == [None] * 20
        and None not in told["apart_mm"][:20]
    )
    flat = judged(standing, **body, **ids("polynomial"), z_mm=[0] * 20 + [150] * 20)["agreement"]
    assert flat["n"] == 20 and flat["from"] == "matches"
    assert judged(standing, **body, **ids(), z_mm=[None] * 40)["agreement"]["from"] == "clicks"
    refusal(standing.post(PAIRS, json={**body, **ids(), "z_mm": [0]}), 422, "bad-matches")


def test_a_match_that_waits_for_its_second_point_counts_only_in_the_numbers(standing, ids):
    body = points(40, heights_mm=(0, 800), mistakes=1)
    plain = judged(standing, **body, **ids())
    waiting = {
        side: [
            None if i in (0, 5) and side == "points_a" else p
            for i, p in enumerate([[9, 9], *given])
        ]
        for side, given in body.items()
    }
    found = judged(standing, **waiting, **ids(), z_mm=[0] * 41)
    assert found["matches"] == 39
    assert found["fundamental"]["outliers"] == [i + 1 for i in plain["fundamental"]["outliers"]]
    assert "1 does not" in plain["fundamental"]["verdict"]["sentence"]
    assert "2 does not" in found["fundamental"]["verdict"]["sentence"]
    parts = (
        ("fundamental", "epipolar_px"),
        ("calibrated", "epipolar_px"),
        ("agreement", "apart_mm"),
    )
    for told in (found[part][name] for part, name in parts):
        assert len(told) == 41 and told[0] is told[5] is None and told[1] is not None
    refusal(
        standing.post(PAIRS, json={"points_a": [None], "points_b": [None]}), 422, "too-few-points"
    )


def on_line(point, line):
    """Whether a point lies within half a pixel of a drawn line."""
    line = np.array([p for p in line if p is not None])
    step = np.diff(line, axis=0)
    share = np.clip(np.sum((point - line[:-1]) * step, axis=1) / np.sum(step**2, axis=1), 0, 1)
    return np.linalg.norm(point - line[:-1] - share[:, None] * step, axis=1).min() < 0.5


def test_lines_are_drawn_by_a_matrix_or_as_two_calibrations_foretell_them(standing, ids):
    body = points(80, noise_px=0.01, heights_mm=(0, 800))
    matrix = judged(standing, **body)["fundamental"]["matrix"]
    some = {side: given[:5] for side, given in body.items()}
    drawn = standing.post(
        f"{PAIRS}/lines",
        json={**some, "matrix": matrix, "image_size_a": [1280, 1024], "image_size_b": [1280, 1024]},
    ).json()
    assert [len(line) for line in drawn["in_b"]] == [2] * 5 and drawn["place_in_b"] is None
    lifted = {side: np.column_stack([given, np.ones(5)]) for side, given in some.items()}
    for lines, fellows in (
        (drawn["in_b"], lifted["points_a"] @ np.array(matrix).T),
        (drawn["in_a"], lifted["points_b"] @ np.array(matrix)),
    ):
        away = np.einsum("nkj,nj->nk", np.array(lines), fellows[:, :2]) + fellows[:, 2:]
        assert np.abs(away / np.linalg.norm(fellows[:, :2], axis=1, keepdims=True)).max() < 1e-6
    bent = standing.post(f"{PAIRS}/lines", json={**some, **ids()}).json()
    for side, given in (("a", body["points_a"]), ("b", body["points_b"])):
        assert all(
            on_line(np.array(point), line)
            for point, line in zip(given, bent[f"in_{side}"], strict=False)
        )
    carpet = points(5, noise_px=0.0)
    placed = standing.post(f"{PAIRS}/lines", json={**carpet, **ids()}).json()
    # px, of two models' own errors
    assert np.allclose(placed["place_in_b"], carpet["points_b"], atol=2)
    hats = points(5, noise_px=0.0, heights_mm=(150, 150))
    placed = standing.post(f"{PAIRS}/lines", json={**hats, **ids(), "z_mm": 150}).json()
    assert np.allclose(placed["place_in_a"], hats["points_a"], atol=2)


def test_models_without_rays_have_no_lines_but_places_on_the_carpet(standing, ids):
    flat = ids("polynomial")
    carpet = points(5, noise_px=0.0)
    told = standing.post(f"{PAIRS}/lines", json={**carpet, **flat}).json()
    assert told["in_a"] is told["in_b"] is None and len(told["place_in_b"]) == 5
    up = standing.post(f"{PAIRS}/lines", json={**carpet, **flat, "z_mm": 150}).json()
    assert up["place_in_b"] is None
    unknown = standing.post(f"{PAIRS}/lines", json={**carpet, **ids(), "z_mm": None}).json()
    assert unknown["place_in_b"] is None and unknown["in_b"]


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"matrix": [[1, 0, 0]] * 3},
        {"calibration_a": "one"},
        {"matrix": [[1, 0]]},
        {
            "matrix": [[1, 0, 0]] * 3,
            "image_size_a": [9, 9],
            "image_size_b": [9, 9],
            "calibration_a": "one",
            "calibration_b": "other",
        },
    ],
)
def test_lines_of_nothing_are_refused(standing, body):
    refusal(standing.post(f"{PAIRS}/lines", json={"points_a": [[1, 2]], **body}), 422, None)


def test_lines_of_a_matrix_that_is_none_are_none(standing):
    asked = {
        "points_a": [[1, 2]],
        "matrix": [[0, 0, 0]] * 3,
        "image_size_a": [640, 480],
        "image_size_b": [640, 480],
    }
    assert standing.post(f"{PAIRS}/lines", json=asked).json()["in_b"] == [None]
    huge = {**asked, "matrix": [[1e308] * 3] * 3}
    assert standing.post(f"{PAIRS}/lines", json=huge).json()["in_b"] == [None]
