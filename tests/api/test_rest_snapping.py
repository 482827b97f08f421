"""Snapping over REST: clicks to the middle of the line, points along a line, and what is refused."""

import numpy as np
import pytest

from tests.support.pictures import encoded
from tests.support.refusals import API, refusal
from tests.support.sim_clicks import border_clicks
from touchline.core.geometry import ImageSize
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.ground import Light
from touchline.sources.sim.render import Rendering, Sensor
from touchline.store.fields import load_fields

FIELD = load_fields()["ssl-div-b"]
REGION = FIELD.regions["full"]
COUNT = 9


@pytest.fixture(scope="module")
def scene(standing):
    """A rendered field, kept as a snapshot, and a fit to exact clicks on its borders."""
    camera = SimCamera.above(
        REGION, ImageSize(1280, 1024), LENSES["mild"], height_mm=6500, tilt_deg=6
    )
    picture = Rendering.of(camera, FIELD, REGION, Motion(robots=0), Light(), Sensor()).frame(0)
    kept = standing.post(f"{API}/snapshots", files={"file": encoded("png", picture)}).json()
    clicks = border_clicks(camera, REGION, 9)
    body = {
        "snapshot": kept["id"],
        "field": FIELD.name,
        "region": "full",
        "model": "division",
        "observations": [{"feature": n, "points": p[1:-1].tolist()} for n, p in clicks.items()],
    }
    preview = standing.post(f"{API}/fit/preview", json=body)
    assert preview.status_code == 200, preview.text
    model = {key: preview.json()["model"][key] for key in ("name", "parameters")}
    fit = {"model": model, "field": FIELD.name, "region": "full"}
    return camera, kept["id"], clicks, fit


def off_the_line(camera, points, feature):
    """px from each point to where the line's middle is seen."""
    places = camera.raw_from_field(FIELD.feature(feature, REGION).sample(8001))
    return np.linalg.norm(np.array(points)[:, None] - places, axis=-1).min(axis=1)


def test_clicks_land_on_the_middle_of_the_line(standing, scene):
    camera, id, clicks, _ = scene
    beside = clicks["left"][2:-2] + np.array([3.0, 0.5])
    answer = standing.post(f"{API}/snapshots/{id}/snap", json={"points": beside.tolist()})
    assert answer.status_code == 200, answer.text
    found = answer.json()["points"]
    assert [p["state"] for p in found] == ["snapped"] * len(beside)
    assert off_the_line(camera, [p["point"] for p in found], "left").mean() < 0.1
    assert found[0]["moved_px"] == pytest.approx(3, abs=0.3)


def test_a_point_without_a_line_is_kept_and_says_why(standing, scene):
    camera, id, _, _ = scene
    middle = camera.raw_from_field(np.array([[1500.0, 900.0]]))[0].tolist()
    [found] = standing.post(f"{API}/snapshots/{id}/snap", json={"points": [middle]}).json()[
        "points"
    ]
    assert found == {
        "state": "kept",
        "point": middle,
        "reason": "no-line",
        "what": "no line within reach",
    }


def test_a_fit_tells_which_of_two_crossing_lines_is_meant(standing, scene):
    camera, id, clicks, fit = scene
    corner = clicks["left"][0]
    point = (
        corner + 0.04 * (clicks["left"][-1] - corner) + 0.02 * (clicks["top"][-1] - corner)
    ).tolist()
    for feature in ("left", "top"):
        [found] = standing.post(
            f"{API}/snapshots/{id}/snap",
            json={"points": [point], "feature": feature, "fit": fit, "reach_px": 40},
        ).json()["points"]
        assert found["state"] == "snapped"
        assert off_the_line(camera, [found["point"]], feature)[0] < 0.2


@pytest.mark.parametrize("feature", ["bottom", "left", "halfway-line", "centre-circle"])
def test_points_are_found_all_along_a_line(standing, scene, feature):
    camera, id, _, fit = scene
    answer = standing.post(
        f"{API}/snapshots/{id}/along", json={"fit": fit, "feature": feature, "count": COUNT}
    )
    assert answer.status_code == 200, answer.text
    found = answer.json()["points"]
    assert len(found) >= COUNT - 2
    assert off_the_line(camera, [p["point"] for p in found], feature).max() < 0.25


def refused(standing, path, body, reason, status=422):
    refusal(standing.post(f"{API}/snapshots/{path}", json=body), status, reason)


def test_what_cannot_be_is_refused(standing, scene):
    _, id, _, fit = scene
    refused(standing, "nobody/snap", {"points": [[1, 1]]}, "unknown-snapshot", 404)
    refused(standing, f"{id}/along", {"fit": fit, "feature": "nowhere"}, "unknown-feature")
    refused(
        standing,
        f"{id}/along",
        {"fit": {**fit, "field": "nowhere"}, "feature": "left"},
        "unknown-field",
        404,
    )
    empty = {**fit, "model": {"name": "division", "parameters": {}}}
    refused(standing, f"{id}/along", {"fit": empty, "feature": "left"}, "bad-parameters")
    refused(standing, f"{id}/snap", {"points": [[1, 1]], "reach_px": 4000}, "out-of-range")


def test_a_fit_of_another_picture_size_is_refused(standing, scene):
    fit = scene[3]
    other = encoded("png", np.zeros((60, 80, 3), np.uint8))
    id = standing.post(f"{API}/snapshots", files={"file": other}).json()["id"]
    refused(standing, f"{id}/along", {"fit": fit, "feature": "left"}, "size-mismatch", 409)


def test_a_landmark_is_no_line(standing, scene):
    _, id, _, fit = scene
    refused(standing, f"{id}/along", {"fit": fit, "feature": "centre"}, "not-a-line")


def test_a_direction_in_degrees_tells_which_of_two_crossing_lines_is_meant(standing, scene):
    camera, id, clicks, _ = scene
    corner = clicks["left"][0]
    point = (
        corner + 0.04 * (clicks["left"][-1] - corner) + 0.02 * (clicks["top"][-1] - corner)
    ).tolist()
    for feature in ("left", "top"):
        x, y = clicks[feature][1] - clicks[feature][0]
        [found] = standing.post(
            f"{API}/snapshots/{id}/snap",
            json={
                "points": [point],
                "direction_deg": float(np.degrees(np.arctan2(y, x))),
                "reach_px": 40,
            },
        ).json()["points"]
        assert found["state"] == "snapped"
        assert off_the_line(camera, [found["point"]], feature)[0] < 0.5
