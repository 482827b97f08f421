"""A camera that is knocked while it is live: found in seconds, told with a cure, and registered anew by one call."""

import math
import re

import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.followed_camera import URL, Followed, task
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.sim_clicks import border_observations
from tests.support.waiting import until
from touchline.evaluate.verdict import level_of
from touchline.main import create_app
from touchline.settings import Settings
from touchline.sources import SourceContext, source_from_url
from touchline.store.fields import load_fields


def test_a_knock_is_found_told_and_registered_anew(followed):
    camera = followed()
    client = camera.client
    first = camera.activated(snapshot=camera.taken())
    steady = camera.becomes("steady")
    assert steady["calibration"] == first and steady["reference"] == "calibration"
    assert steady["px"] < 0.1 and steady["sigma_mm"] < 1 and steady["alarm"] is False
    camera.set_on(knock=3)
    alarm = camera.becomes("knocked")
    assert alarm["px"] == pytest.approx(3, rel=0.15) and alarm["mm"] > 3 * alarm["px"]
    assert (
        alarm["alarm"] is True
        and "has moved" in alarm["sentence"]
        and alarm["fix"]
        and alarm["since"] > 1e9
    )
    assert client.get(f"{camera.path}/status").json()["drift_px"] == pytest.approx(
        alarm["px"], abs=0.2
    )

    def displaced():
        return client.get(f"{camera.path}/drift").json()

    shown = until(displaced, lambda shown: any(place["mm"] > 10 for place in shown["places"]))
    assert shown["calibration"] == first and shown["image_size"] == [480, 384]
    moved_px = [math.dist(place["was"], place["now"]) for place in shown["places"]]
    assert len(moved_px) > 12 and max(moved_px) == pytest.approx(3, rel=0.2)
    assert all(place["level"] == level_of(place["mm"]) for place in shown["places"])
    last = until(displaced, lambda shown: (shown["history"][-1]["mm"] or 0) > 10)["history"][-1]
    assert last["at"] % shown["entry_s"] == 0
    later = client.get(f"{camera.path}/drift", params={"since": last["at"] + 3600}).json()
    assert later["history"] == []

    events = until(
        lambda: client.get(f"{API}/events").json()["items"],
        lambda items: any(event["kind"] == "moved" for event in items),
    )
    moved = next(event for event in events if event["kind"] == "moved")
    assert moved["camera"] == camera.id and re.fullmatch(
        r"Camera-\d+ moved by [\d.]+ mm\.", moved["text"]
    )

    job = finished(client, accepted(client.post(f"{camera.path}/reregister", json={"frames": 3})))
    assert job["state"] == "done", job
    made = client.get(f"{API}/calibrations/{job['result']['calibration']}").json()
    assert made["parent"] == first and made["active"] is False and made["version"] == 2
    draft = client.get(f"{API}/drafts/{made['snapshot']}").json()  # what the version was made of
    same = ("field", "region", "rotate", "observations")
    assert {name: draft[name] for name in same} == {name: made[name] for name in same}
    assert draft["model"] == made["model"]["name"]
    assert draft["options"] == {"lens": first, "lens_sigma": "own"}
    before = client.get(f"{API}/calibrations/{first}").json()
    known = before["report"]["covariance"]
    for term, now, then in zip(
        ("k1", "k2"),
        *(c["model"]["parameters"]["lens_terms"] for c in (made, before)),
        strict=False,
    ):
        at = known["names"].index(term)
        assert abs(now - then) < 3 * known["matrix"][at][at] ** 0.5
    assert job["result"]["picture_px"] == pytest.approx(3, abs=0.8)
    assert camera.drift()["state"] == "knocked"  # never by itself

    activate_despite(client, made["id"])
    again = camera.becomes("steady")
    assert again["calibration"] == made["id"] and again["px"] < 0.2


@pytest.mark.long
def test_a_knock_before_the_server_started_is_seen(tmp_path):
    """Its picture tells: the camera that is there now stands otherwise."""

    def started(source):
        one = {"id": "north", "name": "North", "source": source, "field": "table", "region": "full"}
        return TestClient(
            create_app(Settings(data=tmp_path, cameras=(one,))), base_url="http://127.0.0.1:8000"
        )

    with started(URL) as client:
        camera = Followed(client, "north")
        camera.activated(snapshot=camera.taken())
        camera.becomes("steady")
    with started(URL + "&roll=0.6") as client:
        assert Followed(client, "north").becomes("knocked")["px"] > 1


@pytest.mark.long
def test_without_a_picture_the_first_seconds_are_what_it_is_held_against(followed):
    camera = followed()
    camera.activated(image_size=[480, 384])
    assert camera.becomes("steady")["reference"] == "start"
    camera.set_on(softer=2)
    alarm = camera.becomes("out-of-focus")
    assert alarm["softer_px"] > 1 and "Focus" in alarm["fix"]
    camera.set_on(softer=0)
    camera.becomes("steady")


def test_a_calibration_that_was_never_right_inside_the_field_is_an_alarm_though_nothing_moved(
    followed,
):
    half = "sim://ssl-div-b?region=half&lens=strong&tilt=5&height=5000&size=640x512&robots=0&fps=20"
    camera = followed(half, "ssl-div-b", "half")
    source = source_from_url(half, SourceContext(load_fields()))
    region = load_fields()["ssl-div-b"].region("half")
    camera.activated_of(
        {
            "snapshot": camera.taken(),
            "field": "ssl-div-b",
            "region": "half",
            "model": "polynomial",
            "observations": [o.to_json() for o in border_observations(source.camera, region, 9)],
        }
    )
    told = camera.becomes("misplaced")
    assert (
        told["alarm"] is True
        and told["px"] < 0.1
        and "Largest error" in told["sentence"]
        and told["fix"]
    )


@pytest.mark.parametrize(("aside_px", "is_doubted"), [(0.0, False), (1.0, True)])
def test_a_calibration_whose_lines_lie_centimetres_aside_is_doubted_and_no_alarm(
    followed, aside_px, is_doubted
):
    camera = followed(URL.replace("robots=3", "robots=0"))
    clicks = [
        {**o, "points": [[x + aside_px, y] for x, y in o["points"]]} for o in task()["observations"]
    ]
    camera.activated(snapshot=camera.taken(), observations=clicks)
    told = camera.becomes("steady")
    assert told["alarm"] is False and told["monitored"] is True
    assert ("lines" in told["doubt"]) is is_doubted, told
    assert ("doubt" in told["statements"]) is is_doubted


def test_without_a_calibration_nothing_is_followed_or_registered(followed):
    camera = followed()
    assert camera.drift()["state"] is None
    shown = camera.client.get(f"{camera.path}/drift").json()
    assert (shown["places"], shown["history"], shown["at"]) == ([], [], None)
    refusal(camera.client.get(f"{API}/cameras/nowhere/drift"), 404, "unknown-camera")
    refusal(camera.client.post(f"{camera.path}/reregister"), 409, "not-calibrated")
    refusal(camera.client.post(f"{API}/cameras/nowhere/reregister"), 404, "unknown-camera")
    refusal(camera.client.post(f"{camera.path}/reregister", json={"frames": 0}), 422)


def test_a_picture_without_lines_makes_no_version(followed, picture):
    camera = followed()
    client = camera.client
    first = camera.activated(image_size=[480, 384])
    # of another size, even
    blank = client.post(f"{API}/snapshots", files={"file": picture}).json()["id"]
    job = finished(
        client, accepted(client.post(f"{camera.path}/reregister", json={"snapshot": blank}))
    )
    assert job["state"] == "failed" and job["problem"]["fix"]
    kept = client.get(f"{API}/calibrations?camera={camera.id}").json()["items"]
    assert [one["id"] for one in kept] == [first]
