"""REST of versions that stand already: who activated which, a note that changes, a deletion that is taken back."""

import numpy as np
import pytest

from tests.support.activation import activate_despite
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal, without_size
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.images import frame_from_bytes

CAL = f"{API}/calibrations"


def pixels_of(png):
    return frame_from_bytes(png).pixels


@pytest.fixture
def two(client, task):
    """Two versions of one camera, the older one first."""
    body = {**task, "camera": "north", "model": "homography", "options": {}}
    return [client.post(CAL, json=body).json() for _ in range(2)]


def test_the_versions_from_one_picture_are_listed(client, snapshot, task):
    picture = encoded("png", gradient(64, 48))
    other = client.post(f"{API}/snapshots", files={"file": picture}).json()["id"]
    body = without_size({**task, "snapshot": snapshot["id"], "model": "homography", "options": {}})
    made = [client.post(CAL, json=body).json()["id"] for _ in range(2)]

    def of(snapshot):
        items = client.get(CAL, params={"snapshot": snapshot, "brief": True}).json()["items"]
        return [one["id"] for one in items]

    assert (of(snapshot["id"]), of(other)) == (made[::-1], [])
    refusal(client.get(CAL, params={"snapshot": "../1"}), 422)


def test_the_history_says_what_was_activated_by_whom_newest_first(client, two):
    first, second = two
    for kept, who in ((first, "Ada"), (second, "Grace"), (first, "Ada")):
        activate_despite(client, kept["id"], headers={"X-Operator": who})
    told = client.get(f"{CAL}/activations", params={"camera": "north"}).json()["items"]
    assert [(one["version"], one["by"]) for one in told] == [(1, "Ada"), (2, "Grace"), (1, "Ada")]
    # no picture from a file was ever activated
    assert client.get(f"{CAL}/activations").json()["items"] == []


def test_the_history_keeps_a_version_that_is_deleted(client, two):
    for kept in two:
        activate_despite(client, kept["id"])
    assert client.delete(f"{CAL}/{two[0]['id']}").status_code == 204
    told = client.get(f"{CAL}/activations", params={"camera": "north"}).json()["items"]
    assert [one["version"] for one in told] == [2, None] and told[1]["calibration"] == two[0]["id"]


def test_a_deletion_is_taken_back_and_the_version_is_as_it_was(client, two):
    path = f"{CAL}/{two[0]['id']}"
    before = client.get(path).json()
    assert client.delete(path).status_code == 204
    refusal(client.get(path), 404, "unknown-calibration")
    for _ in range(2):
        assert client.post(f"{path}/restore").json() == before
    assert [kept["version"] for kept in client.get(CAL).json()["items"]] == [2, 1]
    refusal(client.post(f"{CAL}/{'0' * 16}/restore"), 404, "unknown-calibration")


def test_a_note_changes_and_nothing_else_of_the_version(client, two):
    path = f"{CAL}/{two[1]['id']}"
    activate_despite(client, two[1]["id"])
    before = client.get(path).json()
    after = client.patch(path, json={"note": "after the lens was cleaned ü"}).json()
    assert after == {**before, "note": "after the lens was cleaned ü"} and after["active"]
    assert client.get(path).json() == after and client.get(CAL).json()["items"][0] == after
    refusal(client.patch(path, json={"note": "x" * 2001}), 422)
    refusal(client.patch(path, json={"model": "ssl"}), 422)
    refusal(client.patch(f"{CAL}/{'0' * 16}", json={"note": ""}), 404, "unknown-calibration")
    client.delete(f"{CAL}/{two[0]['id']}")
    refusal(client.patch(f"{CAL}/{two[0]['id']}", json={"note": ""}), 404, "unknown-calibration")


@pytest.mark.parametrize("turn_deg", [90, 180, 270])
def test_a_version_for_turned_images_places_turned_pixels_alike(client, calibration, turn_deg):
    answer = client.post(f"{CAL}/{calibration['id']}/turned", json={"turn": turn_deg})
    made = answer.json()
    assert answer.status_code == 201 and answer.headers["location"] == f"{CAL}/{made['id']}"
    assert (made["version"], made["parent"], made["active"]) == (2, calibration["id"], False)
    assert made["note"].startswith("Version 1, turned by")
    turn = QuarterTurn(turn_deg, ImageSize(*calibration["image_size"]))
    assert made["image_size"] == [*turn.size_after]

    def field_from_image(id, pixels):
        body = {"from": "image", "to": "field", "points": pixels.tolist()}
        return client.post(f"{CAL}/{id}/transform", json=body).json()["points"]

    pixels = np.array([[100.0, 100.0], [390.0, 290.0], [700.0, 500.0]])
    np.testing.assert_allclose(
        field_from_image(made["id"], turn.points(pixels)),
        field_from_image(calibration["id"], pixels),
        atol=1e-6,
    )


def test_a_turned_version_has_the_turned_image_and_its_draft(client, calibration):
    made = client.post(f"{CAL}/{calibration['id']}/turned", json={"turn": 90}).json()
    before, after = (
        pixels_of(client.get(f"{API}/snapshots/{one['snapshot']}/image.png").content)
        for one in (calibration, made)
    )
    np.testing.assert_array_equal(after, np.rot90(before, -1))
    snapshots = [
        client.get(f"{API}/snapshots/{one['snapshot']}").json() for one in (calibration, made)
    ]
    assert snapshots[0]["taken_at"] == snapshots[1]["taken_at"]
    assert made["image_sha256"] == snapshots[1]["sha256"]
    draft = client.get(f"{API}/drafts/{made['snapshot']}").json()
    assert draft["observations"] == made["observations"] and draft["rotate"] == made["rotate"]
    url = "corrected.png?width=200"
    first, second = (
        pixels_of(client.get(f"{CAL}/{one['id']}/{url}&snapshot={one['snapshot']}").content)
        for one in (calibration, made)
    )
    assert first.shape == second.shape
    assert np.abs(first.astype(int) - second).max() <= 2  # rounding of the map


def test_a_version_without_an_image_turns_too(client, two):
    made = client.post(f"{CAL}/{two[0]['id']}/turned", json={"turn": 180}).json()
    assert made["snapshot"] is None and (made["version"], made["camera"]) == (3, "north")
    assert made["parent"] == two[0]["id"]
    for path in ("overlay.json", "residuals.json", "uncertainty.json", "report.json", "claims"):
        assert client.get(f"{CAL}/{made['id']}/{path}").status_code == 200, path


def test_a_turn_that_is_none_is_refused(client, two):
    for body in ({"turn": 45}, {"turn": 0}, {"turn": "90"}, {}, {"turn": 90, "more": 1}):
        refusal(client.post(f"{CAL}/{two[0]['id']}/turned", json=body), 422)
    refusal(client.post(f"{CAL}/nowhere/turned", json={"turn": 90}), 404)
    assert len(client.get(CAL).json()["items"]) == 2
