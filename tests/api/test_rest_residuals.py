"""Residual arrows over REST: each ends where the model really puts the point, in either picture, for every model."""

import json

import numpy as np
import pytest

from tests.support.operator import REGION, reference_camera
from tests.support.sim_clicks import border_observations
from touchline.core.records import Observation
from touchline.fitting import FITTERS
from touchline.models import MODELS, RayModel

FIELD = {
    "name": "round-4x3",
    "title": "With a circle",
    "length_mm": 4000,
    "width_mm": 3000,
    "line_sigma_mm": 0,
    "lines": [],
    "arcs": [{"name": "circle", "centre": [100, 50], "radius_mm": 600}],
    "landmarks": {"spot": [-900, 400]},
    "regions": {"full": {"x": [-2000, 2000], "y": [-1500, 1500], "rotate": 0}},
}
SIDES = {"left": (0, -2000), "right": (0, 2000), "top": (1, 1500), "bottom": (1, -1500)}
LENSES = [name for name in MODELS if issubclass(MODELS[name], RayModel)]
CAMERA = reference_camera("strong", 8)


def observations(noise_px=0.3):
    """Borders, a circle and two spots, clicked by a hand; one click on the left border has gone astray."""
    rng = np.random.default_rng(3)
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    circle = np.stack([100 + 600 * np.cos(angle), 50 + 600 * np.sin(angle)], axis=-1)

    def clicks(places):
        return CAMERA.raw_from_field(np.asarray(places, float)) + rng.normal(
            0, noise_px, (len(places), 2)
        )

    borders = list(border_observations(CAMERA, REGION, 9, noise_px, rng))
    left = borders[0].points.copy()
    left[4, 0] += 25
    return [
        o.to_json()
        for o in (
            Observation("left", "line", left),
            *borders[1:],
            Observation("circle", "line", clicks(circle)),
            Observation("spot", "landmark", clicks([[-900, 400]])),
            Observation((1200.0, -700.0), "landmark", clicks([[1200, -700]])),
        )
    ]


@pytest.fixture(scope="module")
def made(standing):
    """A calibration by a model of its name."""
    assert standing.put("/api/v1/fields/round-4x3", json=FIELD).status_code in (200, 201)

    def made(model, extra=()):
        body = {
            "field": "round-4x3",
            "region": "full",
            "image_size": [1280, 1024],
            "model": model,
            "observations": [*observations(), *extra],
        }
        answer = standing.post("/api/v1/calibrations", json=body)
        assert answer.status_code == 201, answer.text
        return answer.json()

    return made


def transformed(client, id, points, source, target, **more):
    answer = client.post(
        f"/api/v1/calibrations/{id}/transform",
        json={"from": source, "to": target, "points": points, **more},
    )
    return np.array(answer.json()["points"], float)


def off_its_place(feature, places):
    """How far field places (n, 2) mm are from a feature, by school geometry."""
    if isinstance(feature, str) and feature in SIDES:
        axis, value = SIDES[feature]
        return np.abs(places[:, axis] - value)
    if feature == "circle":
        return np.abs(np.hypot(*(places - [100, 50]).T) - 600)
    return np.hypot(*(places - ([-900, 400] if feature == "spot" else feature)).T)


@pytest.mark.parametrize("model", FITTERS)
def test_an_arrow_ends_where_the_model_puts_the_nearest_place_of_the_line(standing, made, model):
    id = made(model)["id"]
    found = standing.get(f"/api/v1/calibrations/{id}/residuals.json").json()
    assert len(found["arrows"]) == 9 * 4 + 8 + 2
    for feature in (*SIDES, "circle", "spot", [1200.0, -700.0]):
        arrows = [a for a in found["arrows"] if a["feature"] == feature]
        points, feet = (np.array([a[key] for a in arrows]) for key in ("point", "foot"))
        at_click, at_foot = (
            transformed(standing, id, p.tolist(), "image", "field") for p in (points, feet)
        )
        assert off_its_place(feature, at_foot) == pytest.approx(0, abs=1e-3)
        # Nearest: what the click is off, it is off the place, not along it.
        vector = np.array([a["mm_vector"] for a in arrows])
        np.testing.assert_allclose(at_click + vector, at_foot, atol=1e-3)
        assert np.hypot(*vector.T) == pytest.approx(off_its_place(feature, at_click), abs=1e-3)
        assert [a["mm"] for a in arrows] == pytest.approx(np.hypot(*vector.T))
        assert [a["px"] for a in arrows] == pytest.approx(np.hypot(*(feet - points).T))


@pytest.mark.parametrize("model", ["polynomial", "homography", "brown-conrady"])
def test_in_the_corrected_picture_both_ends_are_where_the_picture_shows_them(standing, made, model):
    id = made(model)["id"]
    raw, corrected = (
        standing.get(
            f"/api/v1/calibrations/{id}/residuals.json?frame={frame}&margin_px={margin}"
        ).json()
        for frame, margin in (("raw", 0), ("corrected", 40))
    )
    assert (raw["frame"], corrected["frame"]) == ("raw", "corrected")
    for end in ("point", "foot"):
        there = transformed(standing, id, [a[end] for a in raw["arrows"]], "image", "corrected")
        np.testing.assert_allclose([a[end] for a in corrected["arrows"]], there + 40, atol=1e-9)
    assert [a["mm"] for a in corrected["arrows"]] == [a["mm"] for a in raw["arrows"]]


def test_the_report_tells_the_same_arrows_and_what_a_pixel_is_worth(standing, made):
    calibration = made("brown-conrady")
    found = standing.get(f"/api/v1/calibrations/{calibration['id']}/residuals.json").json()
    report = calibration["report"]
    told = [r for f in report["per_feature"] for r in f["residuals"]]
    keys = ("point", "foot", "px", "mm", "mm_vector", "outlier")
    assert [{k: a[k] for k in keys} for a in found["arrows"]] == [
        {k: r[k] for k in keys} for r in told
    ]
    fine = [a for a in told if not a["outlier"]]
    clicks, feet = (np.array([a[end] for a in fine]) for end in ("point", "foot"))
    # by a pixel
    moved = clicks + (feet - clicks) / np.linalg.norm(feet - clicks, axis=1, keepdims=True)
    before, after = (
        transformed(standing, calibration["id"], p.tolist(), "image", "field")
        for p in (clicks, moved)
    )
    a_pixel = np.median(np.linalg.norm(after - before, axis=1))
    assert found["mm_per_px"] == report["mm_per_px"] == pytest.approx(a_pixel, rel=0.02)
    assert [(a["feature"], a["index"]) for a in found["arrows"] if a["outlier"]] == [("left", 4)]


def test_on_a_painted_field_an_arrow_ends_on_the_line_where_the_fit_found_it(standing):
    assert standing.put(
        "/api/v1/fields/painted-4x3", json={**FIELD, "name": "painted-4x3", "line_sigma_mm": 5}
    ).status_code in (200, 201)
    body = {
        "field": "painted-4x3",
        "region": "full",
        "image_size": [1280, 1024],
        "model": "brown-conrady",
        "observations": observations(),
    }
    made = standing.post("/api/v1/calibrations", json=body).json()
    offsets = made["report"]["line_offsets_mm"]
    arrows = standing.get(f"/api/v1/calibrations/{made['id']}/residuals.json").json()["arrows"]
    assert max(map(abs, offsets.values())) > 0.05
    for feature in SIDES:
        clicked = [a["foot"] for a in arrows if a["feature"] == feature]
        feet = transformed(standing, made["id"], clicked, "image", "field")
        assert off_its_place(feature, feet) == pytest.approx(abs(offsets[feature]), abs=1e-3)


@pytest.mark.parametrize("model", LENSES)
def test_points_above_the_carpet_have_their_arrows_at_their_height(standing, made, model):
    place = np.array([[600.0, 300.0, 150.0]])
    click = CAMERA.raw_from_field(place)
    raised = {"feature": [600.0, 300.0], "kind": "landmark", "points": click.tolist(), "z_mm": 150}
    id = made(model, [raised])["id"]
    arrow = standing.get(f"/api/v1/calibrations/{id}/residuals.json").json()["arrows"][-1]
    foot = transformed(standing, id, [[600.0, 300.0]], "field", "image", z_mm=150)
    np.testing.assert_allclose([arrow["foot"]], foot, atol=1e-6)
    place_of_click = transformed(standing, id, [arrow["point"]], "image", "field", z_mm=150)
    np.testing.assert_allclose(place_of_click + arrow["mm_vector"], [[600, 300]], atol=1e-6)


def test_an_imported_calibration_without_a_usable_report_has_arrows_none_astray(standing, made):
    file = standing.get(f"/api/v1/calibrations/{made('division')['id']}/export/json").json()
    for report in (
        {**file["report"], "per_feature": "none"},
        {**file["report"], "per_feature": [{"residuals": 3}]},
    ):
        answer = standing.post(
            "/api/v1/calibrations/import",
            files={"file": json.dumps({**file, "report": report}).encode()},
        )
        found = standing.get(f"/api/v1/calibrations/{answer.json()['id']}/residuals.json")
        assert found.status_code == 200, found.text
        assert not any(a["outlier"] for a in found.json()["arrows"])


def test_arrows_of_nothing_known_are_refused_with_what_to_do(standing, made):
    assert standing.get("/api/v1/calibrations/nobody/residuals.json").status_code == 404
    id = made("homography")["id"]
    assert (
        standing.get(f"/api/v1/calibrations/{id}/residuals.json?frame=sideways").status_code == 422
    )
