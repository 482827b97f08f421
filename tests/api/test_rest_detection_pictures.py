"""REST of detections: a snapshot's ball and robots, the pictures of its stages, and what is refused."""

import cv2
import numpy as np
import pytest

from tests.support.pictures import encoded
from tests.support.refusals import API, refusal
from tests.support.sim_truth import truth_at
from tests.support.watched_field import calibration_of, colour_clicks, world
from touchline.formats import FORMATS

DETECTIONS = f"{API}/detections"


@pytest.fixture(scope="module")
def match():
    return world(size=(1280, 800), drift=0.0, noise=3.0)


@pytest.fixture(scope="module")
def asked(standing, match):
    """A body that finds everything: a snapshot, its calibration, clicks."""
    snapshot = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", match.frame_at(0, 0.0))}
    ).json()["id"]
    file = FORMATS["json"].write(calibration_of(match))
    answer = standing.post(f"{API}/calibrations/import", files={"file": ("cal.json", file)})
    assert answer.status_code == 201, answer.text
    clicks = {
        colour: [list(place) for place in places] for colour, places in colour_clicks(match).items()
    }
    return {"snapshot": snapshot, "calibration": answer.json()["id"], "clicks": clicks}


def test_a_snapshot_tells_its_ball_and_robots_in_field_millimetres(standing, asked, match):
    answer = standing.post(DETECTIONS, json=asked)
    assert answer.status_code == 200, answer.text
    told = answer.json()
    truth = {(r.team, r.number): r for r in truth_at(match, 0.0).robots}
    robots = [d for d in told["detections"] if d["kind"] == "robot"]
    assert {(d["team"], d["id"]) for d in robots} == set(truth)
    off = [
        np.hypot(
            d["x_mm"] - truth[d["team"], d["id"]].x_mm, d["y_mm"] - truth[d["team"], d["id"]].y_mm
        )
        for d in robots
    ]
    assert np.median(off) < 6 and [d["kind"] for d in told["detections"]].count("ball") == 1
    assert set(told["took_ms"]) == {"noise", "colours", "blobs", "butterfly", "ball", "places"}
    again = standing.post(
        DETECTIONS, json={**asked, "clicks": None, "colours": told["colours"]}
    ).json()
    assert {(d["team"], d["id"]) for d in again["detections"] if d["kind"] == "robot"} == set(truth)


def test_pictures_of_what_was_found_and_of_each_stage(standing, asked):
    for stage in ("drawn", "colours", "blobs", "butterfly"):
        answer = standing.post(f"{DETECTIONS}/picture.png?stage={stage}", json=asked)
        assert answer.status_code == 200 and answer.headers["content-type"] == "image/png"
        assert cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1).shape == (800, 1280, 3)
    refusal(standing.post(f"{DETECTIONS}/picture.png?stage=tags", json=asked), 404, "unknown-stage")


def test_stages_and_plans_are_listed_and_a_plan_of_ones_own_is_taken(standing, asked):
    told = standing.get(f"{API}/stages").json()
    assert {"noise", "colours", "butterfly", "ball", "places"} <= {
        stage["name"] for stage in told["items"]
    }
    mine = next(plan for plan in told["plans"] if plan["name"] == "ssl")
    mine["stages"] = [stage for stage in mine["stages"] if stage["stage"] != "ball"]
    answer = standing.post(DETECTIONS, json={**asked, "stages": mine}).json()
    assert {d["kind"] for d in answer["detections"]} == {"robot"}


@pytest.mark.parametrize(
    "change, status, reason",
    [
        ({"snapshot": "nobody"}, 404, None),
        ({"calibration": "nobody"}, 404, None),
        ({"stages": "cricket"}, 404, "unknown-stages"),
        ({"stages": {"name": "x"}}, 422, "bad-stages"),
        ({"calibration": None}, 422, "no-scale"),
        ({"colours": {"name": "x"}}, 422, "bad-colours"),
        ({"clicks": {"mauve": [[1, 2]]}}, 422, "unknown-colour"),
        ({"clicks": {"blue": [[1, 2, 3]]}}, 422, "bad-clicks"),
        ({"clicks": {"blue": [[-9, 2]]}}, 422, "click-outside"),
        ({"eye_mm": [0, 0, -1]}, 422, "bad-eye"),
        ({"mm_per_px": 0}, 422, None),
        ({"clicks": {"blue": [[1, 2]] * 41}}, 422, None),
    ],
)
def test_what_makes_no_sense_is_refused(standing, asked, change, status, reason):
    refusal(standing.post(DETECTIONS, json={**asked, **change}), status, reason)


def test_a_picture_of_another_size_than_the_calibration_is_refused(standing, asked):
    other = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", np.zeros((480, 640, 3), np.uint8))}
    ).json()
    refusal(
        standing.post(DETECTIONS, json={**asked, "snapshot": other["id"]}), 409, "size-mismatch"
    )
