"""Of two operators none wins in silence: a change names the state it was made from, and is refused if that is old."""

import pytest

from tests.support.refusals import API, refusal

FIELD = {
    "name": "garage",
    "length_mm": 3000,
    "width_mm": 2000,
    "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}},
}
TASK_PATH = f"{API}/calibrations"


def etag(response):
    assert response.status_code < 300, response.text
    return response.headers["ETag"]


def stale(response, reason):
    told = refusal(response, 412, reason)
    assert told["detail"] and told["fix"] and "current" in told
    return told


@pytest.fixture
def versions(client, task):
    """Two versions of one camera, none of them active, by their ids."""
    return [client.post(TASK_PATH, json={**task, "camera": "north"}).json()["id"] for _ in range(2)]


def test_the_slower_of_two_who_change_a_field_is_told(client):
    path = f"{API}/fields/garage"
    seen = etag(client.put(path, json=FIELD))
    assert etag(client.get(path)) == seen
    first = client.put(path, json={**FIELD, "width_mm": 2100}, headers={"If-Match": seen})
    assert etag(first) != seen
    told = stale(
        client.put(path, json={**FIELD, "width_mm": 2200}, headers={"If-Match": seen}),
        "stale-field",
    )
    assert told["current"]["width_mm"] == 2100 and client.get(path).json()["width_mm"] == 2100
    assert client.put(path, json=FIELD).status_code == 200, "whoever names no state replaces any"


def test_a_field_that_is_not_there_was_not_seen(client):
    told = stale(
        client.put(f"{API}/fields/garage", json=FIELD, headers={"If-Match": '"0123456789abcdef"'}),
        "stale-field",
    )
    assert told["current"] is None and client.get(f"{API}/fields/garage").status_code == 404


def test_the_slower_of_two_who_change_what_is_published_is_told(client):
    path = f"{API}/publishing"
    seen = etag(client.get(path))
    assert etag(client.put(path, json={"limit_mm": 20}, headers={"If-Match": seen})) != seen
    told = stale(
        client.put(path, json={"limit_mm": 30}, headers={"If-Match": seen}), "stale-publishing"
    )
    assert told["current"]["limit_mm"] == 20 and client.get(path).json()["limit_mm"] == 20
    assert client.put(path, json={"limit_mm": 30}).json()["limit_mm"] == 30


def test_the_slower_of_two_who_write_a_note_is_told(client, versions):
    path = f"{TASK_PATH}/{versions[0]}"
    seen = etag(client.get(path))
    assert etag(client.patch(path, json={"note": "by day"}, headers={"If-Match": seen})) != seen
    told = stale(
        client.patch(path, json={"note": "by night"}, headers={"If-Match": seen}),
        "stale-calibration",
    )
    assert told["current"]["note"] == "by day" and client.get(path).json()["note"] == "by day"


def test_a_version_that_got_a_note_is_not_deleted_by_who_did_not_see_it(client, versions):
    path = f"{TASK_PATH}/{versions[0]}"
    seen = etag(client.get(path))
    client.patch(path, json={"note": "the good one"})
    stale(client.delete(path, headers={"If-Match": seen}), "stale-calibration")
    assert client.delete(path, headers={"If-Match": etag(client.get(path))}).status_code == 204


def test_the_slower_of_two_who_activate_is_told_who_was_faster(client, versions):
    first, second = versions
    history = f"{TASK_PATH}/activations?camera=north"

    # The first live image may come between two requests.
    despite = [*client.post(f"{TASK_PATH}/{first}/activate").json()["despite"], "live-image"]

    def activate(id, seen, by):
        headers = {"X-Operator": by} if seen is None else {"X-Operator": by, "If-Match": seen}
        return client.post(f"{TASK_PATH}/{id}/activate", json={"despite": despite}, headers=headers)

    assert etag(client.get(history)) == '"none"'
    assert activate(first, '"none"', "Ada").status_code == 200
    assert etag(client.get(history)) == f'"{first}"'
    told = stale(activate(second, '"none"', "Bea"), "stale-activation")
    assert (
        "Ada has activated version 1" in told["detail"] and told["current"]["calibration"] == first
    )
    assert client.get(f"{TASK_PATH}/{first}").json()["active"]
    assert activate(first, '"none"', "Bea").status_code == 200, "what both want is no quarrel"
    assert activate(second, first, "Bea").status_code == 200
    assert activate(first, None, "Cy").status_code == 200, "a script may say nothing of it"
