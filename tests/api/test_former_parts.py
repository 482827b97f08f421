"""An archive of an earlier version opens with parts that have gone, and each says what to do."""

import json

import pytest
from starlette.testclient import TestClient

from tests.support.exported import example
from tests.support.folder_pictures import clicks, picture
from tests.support.refusals import API
from tests.support.waiting import until
from touchline.main import create_app
from touchline.settings import Settings
from touchline.store.archive import restore_into
from touchline.store.store import Store

CAMERA = {
    "name": "East",
    "source": "genicam://4711?producer=mvGenTLProducer",
    "field": None,
    "region": None,
}
BATCH = {
    "run": "app.batch.tasks:run_picture",
    "spec": {},
    "keep": None,
    "about": None,
    "lasts": True,
}


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """The ids of the version and of the job, and a client of a server on the restored archive."""
    folder = tmp_path_factory.mktemp("former")
    with Store(folder / "before") as store:
        version = store.calibrations.add(example("thin-plate", 2)).id
        store.cameras.add("east", CAMERA, "ann")
        (folder / "all.zip").write_bytes(b"".join(store.archive(folder / "fields")))
    restore_into(folder / "all.zip", folder / "after", None)
    with Store(folder / "after") as store:
        job = store.jobs.add("batch", BATCH).id  # archives have none
    app = create_app(Settings(data=folder / "after"))
    with TestClient(app, base_url="http://127.0.0.1:8000") as client:
        yield version, job, client


def test_a_version_of_a_model_that_is_fitted_no_more_is_shown_and_used(opened):
    version, _, client = opened
    shown = client.get(f"{API}/calibrations/{version}").json()
    assert shown["model"]["name"] == "thin-plate"
    points = {"from": "image", "to": "field", "points": [[600, 500]]}
    assert (
        client.post(f"{API}/calibrations/{version}/transform", json=points).json()["points"][0]
        is not None
    )
    assert client.get(f"{API}/calibrations/{version}/report.html").status_code == 200
    assert client.get(f"{API}/calibrations/{version}/export/json").status_code == 200
    asked = client.get(f"{API}/calibrations/{version}/uncertainty.json")
    assert asked.status_code == 409 and "lens model" in asked.json()["fix"]
    listed = {
        model["name"]: model["is_fitted"] for model in client.get(f"{API}/models").json()["items"]
    }
    assert listed.pop("thin-plate") is False and set(listed.values()) == {True}


def test_a_camera_of_a_kind_that_is_read_no_more_says_what_to_enter(opened):
    *_, client = opened
    assert [camera["id"] for camera in client.get(f"{API}/cameras").json()["items"]] == ["east"]

    def told_by_its_process():
        problem = client.get(f"{API}/cameras/east/status").json()["problem"]
        return problem if problem and problem["reason"] == "genicam-removed" else None

    told = until(told_by_its_process)
    assert "aravis:// and its serial number" in told["fix"]
    again = client.post(f"{API}/cameras", json={"id": "west", "source": CAMERA["source"]})
    assert again.status_code == 404 and "aravis://" in again.json()["fix"]


def test_a_job_of_a_kind_that_has_gone_has_failed_with_what_to_do(opened):
    _, job, client = opened
    told = client.get(f"{API}/jobs/{job}").json()
    assert told["state"] == "failed" and told["problem"]["fix"]
    assert "does not support this job" in told["problem"]["detail"]


def test_a_draft_that_names_a_model_that_is_fitted_no_more_is_fitted_with_another_and_told(
    opened, tmp_path
):
    *_, client = opened
    task = json.loads(clicks(tmp_path / "clicks.json").read_text())
    body = {**task, "model": "thin-plate", "options": {"base": "division", "smoothing": 0.0}}
    for quick in (True, False):
        fitted = client.post(f"{API}/fit/preview", json=body, params={"quick": quick}).json()
        assert fitted["model"]["name"] in ("brown-conrady", "fisheye", "division")
        (told,) = [w for w in fitted["report"]["warnings"] if w["reason"] == "model-removed"]
        assert told["text"].startswith("Thin-plate spline is no longer fitted.") and told["fix"]
    image = picture(tmp_path / "field.png").read_bytes()
    snapshot = client.post(f"{API}/snapshots", files={"file": image}).json()
    made = client.post(f"{API}/calibrations", json={**body, "snapshot": snapshot["id"]})
    assert made.status_code == 201 and made.json()["model"]["name"] != "thin-plate"
    assert "smoothing" not in made.json()["options"]
    ranked = client.post(
        f"{API}/calibrations/compare",
        json={**body, "snapshot": snapshot["id"], "models": ["division", "thin-plate"]},
    ).json()
    assert [one["model"] for one in ranked["ranking"]] == ["division"]
    assert [one["reason"] for one in ranked["failed"]] == ["model-removed"]
