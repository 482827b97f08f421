"""A camera that is knocked while it is live: found in seconds, told with a cure, and registered anew by one call."""

import re

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from app.sources import SourceContext, source_from_url
from app.store.fields import load_fields
from tests.support.live_cameras import calibrated
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.sim_clicks import border_observations
from tests.support.waiting import until

URL = "sim://table?size=480x384&fps=20&robots=3"
CAMERAS = ({"id": "north", "name": "North", "source": URL, "field": "table", "region": "full"},)
LONG_S = 60.0  # a machine that is busy paints and looks slowly


@pytest.fixture
def served(tmp_path):
    with TestClient(create_app(Settings(data=tmp_path, cameras=CAMERAS)), base_url="http://127.0.0.1:8000") as client:
        yield client


def drift(client):
    return client.get(f"{API}/cameras/north/status").json()["drift"] or {"state": None}


def becomes(client, state):
    return until(lambda: drift(client), lambda now: now["state"] == state)


def activated(client, model="brown-conrady", **more):
    made = calibrated(URL, model)
    answer = client.post(f"{API}/calibrations", json={
        "camera": "north", "field": "table", "region": "full", "model": model,
        "observations": [dict(o) for o in made.observations], **more})
    assert answer.status_code == 201, answer.text
    id = answer.json()["id"]
    assert client.post(f"{API}/calibrations/{id}/activate").status_code == 200
    return id


def set_on(client, **controls):
    assert client.patch(f"{API}/cameras/north/controls", json={"controls": controls}).status_code == 200


def test_a_knock_is_found_told_and_registered_anew(served):
    taken = served.post(f"{API}/snapshots", json={"camera": "north"}).json()["id"]
    first = activated(served, snapshot=taken)
    steady = becomes(served, "steady")
    assert steady["calibration"] == first and steady["reference"] == "calibration"
    assert steady["px"] < 0.1 and steady["sigma_mm"] < 1 and steady["alarm"] is False
    set_on(served, knock=3)
    alarm = becomes(served, "knocked")
    assert alarm["px"] == pytest.approx(3, rel=0.15) and alarm["mm"] > 3 * alarm["px"]
    assert alarm["alarm"] is True and "has moved" in alarm["sentence"] and alarm["fix"] and alarm["since"] > 1e9
    assert served.get(f"{API}/cameras/north/status").json()["drift_px"] == pytest.approx(alarm["px"], abs=0.2)

    events = until(lambda: served.get(f"{API}/events").json()["items"],
                   lambda items: any(event["kind"] == "moved" for event in items))
    moved = next(event for event in events if event["kind"] == "moved")
    assert moved["camera"] == "north" and re.fullmatch(r"North moved by [\d.]+ mm\.", moved["text"])

    job = finished(served, accepted(served.post(f"{API}/cameras/north/reregister", json={"frames": 3})))
    assert job["state"] == "done", job
    made = served.get(f"{API}/calibrations/{job['result']['calibration']}").json()
    assert made["parent"] == first and made["active"] is False and made["version"] == 2
    before = served.get(f"{API}/calibrations/{first}").json()
    known = before["report"]["covariance"]
    for term, now, then in zip(("k1", "k2"), *(c["model"]["parameters"]["lens_terms"] for c in (made, before)),
                               strict=False):
        at = known["names"].index(term)
        assert abs(now - then) < 3 * known["matrix"][at][at] ** 0.5
    assert job["result"]["picture_px"] == pytest.approx(3, abs=0.8)
    assert drift(served)["state"] == "knocked"  # never by itself

    served.post(f"{API}/calibrations/{made['id']}/activate")
    again = becomes(served, "steady")
    assert again["calibration"] == made["id"] and again["px"] < 0.2


@pytest.mark.long
def test_a_knock_before_the_server_started_is_seen(tmp_path):
    """Its picture tells: the camera that is there now stands otherwise."""
    with TestClient(create_app(Settings(data=tmp_path, cameras=CAMERAS)), base_url="http://127.0.0.1:8000") as client:
        activated(client, snapshot=client.post(f"{API}/snapshots", json={"camera": "north"}).json()["id"])
        becomes(client, "steady")
    bent = ({**CAMERAS[0], "source": URL + "&roll=0.6"},)
    with TestClient(create_app(Settings(data=tmp_path, cameras=bent)), base_url="http://127.0.0.1:8000") as client:
        assert becomes(client, "knocked")["px"] > 1


@pytest.mark.long
def test_without_a_picture_the_first_seconds_are_what_it_is_held_against(served):
    activated(served, image_size=[480, 384])
    assert becomes(served, "steady")["reference"] == "start"
    set_on(served, softer=2)
    alarm = becomes(served, "out-of-focus")
    assert alarm["softer_px"] > 1 and "Focus" in alarm["fix"]
    set_on(served, softer=0)
    becomes(served, "steady")


def test_a_calibration_that_was_never_right_inside_the_field_is_an_alarm_though_nothing_moved(tmp_path):
    half = "sim://ssl-div-b?region=half&lens=strong&tilt=5&height=5000&size=640x512&robots=0&fps=20"
    camera = {"id": "north", "name": "North", "source": half, "field": "ssl-div-b", "region": "half"}
    with TestClient(create_app(Settings(data=tmp_path, cameras=[camera])), base_url="http://127.0.0.1:8000") as client:
        taken = client.post(f"{API}/snapshots", json={"camera": "north"}).json()["id"]
        source = source_from_url(half, SourceContext(load_fields()))
        region = load_fields()["ssl-div-b"].region("half")
        made = client.post(f"{API}/calibrations", json={
            "camera": "north", "snapshot": taken, "field": "ssl-div-b", "region": "half", "model": "polynomial",
            "observations": [o.to_json() for o in border_observations(source.camera, region, 9)]}).json()
        assert client.post(f"{API}/calibrations/{made['id']}/activate").status_code == 200
        told = becomes(client, "misplaced")
    assert told["alarm"] is True and told["px"] < 0.1 and "Largest error" in told["sentence"] and told["fix"]


def test_without_a_calibration_nothing_is_followed_or_registered(served):
    assert drift(served)["state"] is None
    refusal(served.post(f"{API}/cameras/north/reregister"), 409, "not-calibrated")
    refusal(served.post(f"{API}/cameras/nowhere/reregister"), 404, "unknown-camera")
    refusal(served.post(f"{API}/cameras/north/reregister", json={"frames": 0}), 422)


def test_a_picture_without_lines_makes_no_version(served, picture):
    first = activated(served, image_size=[480, 384])
    blank = served.post(f"{API}/snapshots", files={"file": picture}).json()["id"]  # of another size, even
    job = finished(served, accepted(served.post(f"{API}/cameras/north/reregister", json={"snapshot": blank})))
    assert job["state"] == "failed" and job["problem"]["fix"]
    kept = served.get(f"{API}/calibrations?camera=north").json()["items"]
    assert [one["id"] for one in kept] == [first]
