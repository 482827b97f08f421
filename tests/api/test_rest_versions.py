"""REST of versions that stand already: who activated which, a note that changes, a deletion that is taken back."""

import pytest

from tests.support.activation import activate_despite
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal, without_size

CAL = f"{API}/calibrations"


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
