"""REST of judging: expected error, differences between versions, heights and held lenses."""

import json

import numpy as np
import pytest

from tests.support.operator import REGION, reference_camera
from tests.support.sim_clicks import border_observations
from touchline.images import frame_from_bytes

FIELD = {
    "name": "plain-4x3",
    "title": "Plain",
    "length_mm": 4000,
    "width_mm": 3000,
    "lines": [],
    "arcs": [],
    "landmarks": {},
    "regions": {"full": {"x": [-2000, 2000], "y": [-1500, 1500], "rotate": 0}},
}


def body(model="brown-conrady", seed=0, **options):
    camera = reference_camera("strong", 8)
    observations = border_observations(
        camera, REGION, 9, 0.3, np.random.default_rng(seed), anywhere=True
    )
    return {
        "field": "plain-4x3",
        "region": "full",
        "image_size": [1280, 1024],
        "model": model,
        "options": options,
        "observations": [o.to_json() for o in observations],
    }


@pytest.fixture(scope="module")
def known_field(standing):
    assert standing.put("/api/v1/fields/plain-4x3", json=FIELD).status_code in (200, 201)
    return standing


def made(client, **given):
    answer = client.post("/api/v1/calibrations", json=body(**given))
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_expected_error_over_the_field_as_numbers_and_as_a_picture(known_field):
    id = made(known_field, height_mm={"value": 4150.0, "sigma": 30.0})["id"]
    carpet, hat = (
        known_field.get(f"/api/v1/calibrations/{id}/uncertainty.json?z_mm={z}").json()
        for z in (0, 150)
    )
    assert 0.5 < carpet["rms"] < carpet["max"] < 8
    assert hat["rms"] >= carpet["rms"] * 0.9 and hat["z_mm"] == 150
    assert np.array(carpet["grid"]["sigma_mm"]).max() == pytest.approx(carpet["max"])
    picture = known_field.get(f"/api/v1/calibrations/{id}/uncertainty.png")
    assert picture.headers["content-type"] == "image/png"
    assert frame_from_bytes(picture.content).size.width > 640


def test_a_model_without_common_parameters_says_what_to_do(known_field):
    id = made(known_field, model="polynomial")["id"]
    refusal = known_field.get(f"/api/v1/calibrations/{id}/uncertainty.json")
    assert refusal.status_code == 409 and refusal.json()["fix"]
    assert refusal.json()["type"].endswith("no-covariance")


def test_a_picture_of_the_difference_from_a_camera_that_sees_no_carpet_is_refused(known_field):
    one = made(known_field)["id"]
    record = known_field.get(f"/api/v1/calibrations/{one}/export/json").json()
    record["model"]["parameters"]["rotation"] = [0.0, 0.0, 0.0]  # it looks up
    imported = known_field.post(
        "/api/v1/calibrations/import", files={"file": ("up.json", json.dumps(record))}
    )
    other = imported.json()["id"]
    assert (
        known_field.get(f"/api/v1/calibrations/{one}/difference/{other}.json").json()["grid"]
        is None
    )
    refusal = known_field.get(f"/api/v1/calibrations/{one}/difference/{other}.png")
    assert (
        refusal.status_code == 422
        and refusal.json()["fix"]
        and refusal.json()["type"].endswith("no-overlap")
    )


def test_two_versions_are_compared_as_numbers_and_as_a_picture(known_field):
    one, other = made(known_field)["id"], made(known_field, model="polynomial")["id"]
    found = known_field.get(f"/api/v1/calibrations/{one}/difference/{other}.json").json()
    assert found["max_mm"] > 20 and found["median_mm"] < found["max_mm"] and found["rms_px"] > 1
    same = known_field.get(f"/api/v1/calibrations/{one}/difference/{one}.json").json()
    vectors = np.array(found["grid"]["mm_vector"], float)
    np.testing.assert_allclose(
        np.linalg.norm(vectors, axis=-1), np.array(found["grid"]["mm"], float)
    )
    assert same["max_mm"] < 1e-6
    assert (
        known_field.get(f"/api/v1/calibrations/{one}/difference/{other}.png").content[:4]
        == b"\x89PNG"
    )
    assert known_field.get(f"/api/v1/calibrations/{one}/difference/nobody.json").status_code == 404


def test_a_lens_is_taken_over_by_the_id_of_its_calibration(known_field):
    first = made(known_field, terms=["k1", "k2"], height_mm={"value": 4150.0, "sigma": 30.0})
    second = made(known_field, seed=1, lens=first["id"])
    assert second["model"]["parameters"]["lens_terms"] == first["model"]["parameters"]["lens_terms"]
    assert second["options"]["lens"]["name"] == "brown-conrady"
    missing = known_field.post("/api/v1/calibrations", json=body(lens="nobody"))
    assert missing.status_code == 404 and missing.json()["fix"]


@pytest.mark.parametrize(
    "options",
    [
        {"height_mm": 4150},
        {"height_mm": {"value": 4150.0}},
        {"terms": ["k9"]},
        {"height_mm": {"value": -5.0, "sigma": 1.0}},
        {"line_sigma_mm": -1.0},
        {"lens": {"name": "brown-conrady", "parameters": "no"}},
        {"degree": 3},
    ],
)
def test_options_out_of_range_are_refused_by_name(known_field, options):
    refusal = known_field.post("/api/v1/calibrations", json=body(**options))
    assert refusal.status_code == 422, refusal.text
    assert refusal.json()["fix"]
