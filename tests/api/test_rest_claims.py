"""Claims over REST: what is told of a version is made false, and is not held; no activation passes that over."""

import pytest
from starlette.testclient import TestClient

from tests.api.conftest import HERE
from tests.support.activation import activate_despite
from tests.support.followed_camera import URL, Followed, task
from tests.support.live_cameras import calibrated
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from tests.support.waiting import until
from touchline.main import create_app
from touchline.settings import Settings

CAL = f"{API}/calibrations"


def claims_of(client, id, **params):
    answer = client.get(f"{CAL}/{id}/claims", params=params).json()
    return answer["gate"], {claim["code"]: claim for claim in answer["items"]}


def states(client, id):
    return {code: claim["state"] for code, claim in claims_of(client, id)[1].items()}


def readiness(client):
    answer = client.get(f"{API}/readiness").json()
    return answer["gate"], {claim["code"]: claim for claim in answer["items"]}


def against(client, id, **sent):
    """The codes of what an activation is refused for."""
    problem = refusal(client.post(f"{CAL}/{id}/activate", **sent), 409)
    assert problem["type"].endswith("problems-found") and problem["fix"]
    assert all(
        claim["title"] and claim["state"] != "held" and claim["gates"]
        for claim in problem["claims"]
    )
    return [claim["code"] for claim in problem["claims"]]


def active(client, camera):
    return client.get(f"{API}/cameras/{camera.id}").json()["active_calibration"]


@pytest.fixture(scope="module")
def good(followed):
    """A camera that is live, and a version of it that nothing speaks against; its camera stands as it did."""
    camera = followed()
    return camera, camera.saved(task(snapshot=camera.taken()))


def test_what_is_held_was_tried_and_a_good_version_is_activated_without_a_question(good):
    camera, id = good
    gate, claims = claims_of(camera.client, id)
    assert gate in ("ready", "not-tested"), claims
    assert {
        claims[code]["state"] for code in ("lines", "live-image", "region", "accuracy", "model")
    } == {"held"}
    assert all(claim["tried"] for claim in claims.values() if claim["state"] == "held")
    quick = claims_of(camera.client, id, look=False)[1]
    assert "live-image" not in quick and quick["accuracy"] == claims["accuracy"]
    assert camera.client.post(f"{CAL}/{id}/activate").status_code == 200
    assert (
        camera.client.get(f"{CAL}/activations", params={"camera": camera.id}).json()["items"][0][
            "despite"
        ]
        == []
    )


def test_a_camera_that_moved_since_its_picture_was_taken_is_seen_before_activation_and_going_back(
    good,
):
    camera, first = good
    client = camera.client
    activate_despite(client, first)
    camera.set_on(knock=12)
    try:
        second = camera.saved(task(snapshot=camera.taken(), note="of the picture before"))
        until(lambda: states(client, second), lambda found: found["live-image"] == "refuted")
        assert "live-image" in against(client, second)
        assert active(client, camera) == first
        codes = against(client, second, json={"despite": ["accuracy"]})
        done = client.post(f"{CAL}/{second}/activate", json={"despite": codes})
        assert done.status_code == 200
        assert "live-image" in against(client, first)  # going back
    finally:
        camera.set_on(knock=0)
    newest = client.get(f"{CAL}/activations", params={"camera": camera.id}).json()["items"][0]
    assert newest["calibration"] == second and newest["despite"] == codes
    event = next(
        one for one in client.get(f"{API}/events").json()["items"] if one["kind"] == "activated"
    )
    assert event["despite"] == codes and f"Known problems: {len(codes)}." in event["text"]


def test_a_version_in_which_the_field_is_turned_is_not_activated_over_one_in_which_it_is_not(good):
    """Lines look alike from both ends; what lies beside them does not."""
    camera, first = good
    client, snapshot = camera.client, camera.taken()
    activate_despite(client, first)
    same, turned = (camera.saved(task(snapshot=snapshot, rotate=rotate)) for rotate in (0, 180))
    assert (states(client, same)["ends"], states(client, turned)["ends"]) == ("held", "refuted")
    assert states(client, first)["ends"] == "not-tested"  # against what?
    assert "ends" in against(client, turned) and active(client, camera) == first


def changed(client, camera, **values):
    seen = {"If-Match": client.get(camera.path).headers["ETag"]}
    assert client.patch(camera.path, json=values, headers=seen).status_code == 200


def test_a_version_of_another_area_field_or_size_is_not_activated_without_a_question(good):
    camera, _ = good
    client = camera.client
    version = camera.saved(task(snapshot=camera.taken()))
    for values, code in (
        ({"region": "half-left"}, "region"),
        ({"field": "vsss-3v3", "region": None}, "camera-field"),
    ):
        changed(client, camera, **values)
        try:
            assert code in against(client, version)
            report = client.get(f"{CAL}/{version}/report.json").json()
            assert [claim["state"] for claim in report["claims"] if claim["code"] == code] == [
                "refuted"
            ]
        finally:
            changed(client, camera, field="table", region="full")
    small = client.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(320, 256))}
    ).json()["id"]
    other = task()
    other["observations"] = [
        {**one, "points": [[x / 1.5, y / 1.5] for x, y in one["points"]]}
        for one in other["observations"]
    ]
    of_small = camera.saved({**other, "snapshot": small})
    assert states(client, of_small)["live-image"] == "refuted" and "live-image" in against(
        client, of_small
    )


def test_what_cannot_be_tested_is_not_held(client):
    """A version without a picture, of a camera that is not there."""
    made = client.post(CAL, json={**task(image_size=[480, 384]), "camera": "gone"}).json()["id"]
    gate, claims = claims_of(client, made)
    assert (
        claims["lines"]["state"] == "not-tested"
        and "live-image" not in claims
        and gate == "not-tested"
    )
    client.post(
        f"{API}/cameras", json={"id": "dead", "source": "picture://none.png", "field": "table"}
    )
    other = client.post(CAL, json={**task(image_size=[480, 384]), "camera": "dead"}).json()["id"]
    assert claims_of(client, other)[1]["live-image"]["state"] == "not-tested"
    refusal(client.get(f"{CAL}/nothing/claims"), 404)
    refusal(client.post(f"{CAL}/{made}/activate", json={"despite": "all"}), 422)


def test_a_site_is_ready_only_where_each_camera_is_seen_to_stand_as_it_did(followed):
    camera = followed(URL.replace("robots=3", "robots=0"))
    client = camera.client
    gate, claims = readiness(client)
    assert gate == "problems" and claims["cameras-calibrated"]["state"] == "refuted"
    assert claims["cameras-in-place"]["state"] == "not-tested"  # nobody watches
    camera.activated(snapshot=camera.taken())
    camera.becomes("steady")
    camera.set_on(knock=4)
    camera.becomes("knocked")
    gate, claims = readiness(client)
    assert (gate, claims["cameras-in-place"]["state"], claims["cameras-in-place"]["camera"]) == (
        "problems",
        "refuted",
        camera.id,
    )


HALF = (
    "sim://ssl-div-b?cameras=2&camera={}&size=480x384&fps=10&tilt=3&play=field&robots=4&serial={}"
)


def test_exchanged_cables_and_one_stream_under_two_cameras_are_seen_though_the_halves_look_alike(
    tmp_path,
):
    left, right = (
        {
            "id": region,
            "source": HALF.format(number, number),
            "field": "ssl-div-b",
            "region": region,
        }
        for number, region in enumerate(("half-left", "half-right"))
    )
    with TestClient(create_app(Settings(data=tmp_path)), base_url=HERE) as client:
        for half in (left, right):
            client.post(f"{API}/cameras", json=half)
            camera = Followed(client, half["id"])
            camera.activated_of(version_of(half, snapshot=camera.taken()))

        def own_images(said, state="refuted"):
            found = until(
                lambda: readiness(client)[1]["cameras-own-images"],
                lambda claim: claim["state"] == state and said in claim["title"],
            )
            assert bool(found["tried"]) and found["gates"] is (state == "refuted") is bool(
                found["fix"]
            )
            return found

        own_images("own image", "held")
        # as if by another cable
        changed(client, camera := Followed(client, "half-left"), source=HALF.format(1, 0))
        changed(client, other := Followed(client, "half-right"), source=HALF.format(0, 1))
        assert own_images("exchanged")["camera"] == "half-left"
        again = camera.saved(version_of(left, image_size=[480, 384]))
        claim = until(
            lambda: claims_of(client, again)[1]["live-image"],
            lambda claim: claim["state"] == "refuted",
        )
        assert "another camera" in claim["title"] and "live-image" in against(client, again)
        changed(client, other, source=HALF.format(1, 1) + "&noise=3")
        own_images("same image")
        changed(client, other, source=HALF.format(1, 0))
        own_images("same address")


def version_of(half, **more):
    observations = calibrated(half["source"], "brown-conrady", region=half["region"]).observations
    return {
        "field": half["field"],
        "region": half["region"],
        "model": "brown-conrady",
        "observations": [dict(one) for one in observations],
        **more,
    }
