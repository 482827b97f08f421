"""Cameras that operators added, and the evidence of which camera an id means."""

import pytest

from tests.support.store_opener import damage_row
from touchline.core.errors import BadInput, Conflict, NotFound, Stale
from touchline.store.tables import CameraRow

BODY = {
    "name": "North half",
    "source": "rtsp://10.0.0.5/live",
    "field": "ssl-div-b",
    "region": "half-left",
}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


def test_a_camera_is_kept_changed_and_removed_and_comes_back_after_a_restart(opener, store):
    added = store.cameras.add("north", BODY)
    store.cameras.add("a-south", {**BODY, "name": "South"})
    # as they were added
    assert [camera.name for camera in store.cameras.all()] == ["north", "a-south"]
    changed = store.cameras.save("north", {**BODY, "name": "North"}, added.etag)
    assert changed.etag != added.etag and changed.body["name"] == "North"
    store.close()
    with opener(store.folder) as again:
        assert again.cameras.get("north") == changed
        again.cameras.delete("north", changed.etag)
        assert [camera.name for camera in again.cameras.all()] == ["a-south"]
        with pytest.raises(NotFound):
            again.cameras.get("north")


def test_an_id_is_given_once(store):
    store.cameras.add("north", BODY)
    with pytest.raises(Conflict) as refused:
        store.cameras.add("north", BODY)
    assert refused.value.reason == "camera-exists"


def test_who_was_slower_neither_overwrites_nor_removes(store):
    first = store.cameras.add("north", BODY)
    store.cameras.save("north", {**BODY, "name": "theirs"}, first.etag)
    for slower in (
        lambda: store.cameras.save("north", {**BODY, "name": "ours"}, first.etag),
        lambda: store.cameras.delete("north", first.etag),
    ):
        with pytest.raises(Stale) as refused:
            slower()
        assert refused.value.details["current"]["name"] == "theirs"
    assert store.cameras.get("north").body["name"] == "theirs"


def test_the_evidence_of_a_camera_is_kept_for_any_id_and_goes_with_it(opener, store):
    assert store.identities.get("from-settings") is None
    store.identities.confirm("from-settings", {"serial": "A1"})
    store.identities.confirm("from-settings", {"serial": "B2"})
    store.cameras.add("north", BODY)
    store.identities.confirm("north", {"serial": "C3"})
    store.close()
    with opener(store.folder) as again:
        assert again.identities.get("from-settings") == {"serial": "B2"}
        again.cameras.delete("north")
        assert again.identities.get("north") is None


@pytest.mark.parametrize(
    "id", ["../outside", "/etc/outside", "", ".", "a\0b", "x" * 300, "\ud800", ".hidden"]
)
def test_an_id_that_nobody_could_have_is_unknown_and_is_not_kept(store, id):
    with pytest.raises(NotFound):
        store.cameras.get(id)
    assert store.identities.get(id) is None
    for refused in (
        lambda: store.identities.confirm(id, {"serial": "A1"}),
        lambda: store.cameras.add(id, BODY),
    ):
        with pytest.raises(BadInput):
            refused()


def test_a_damaged_definition_is_named_and_hides_no_other(store):
    store.cameras.add("north", BODY)
    store.cameras.add("south", BODY)
    damage_row(store, CameraRow, lambda text: "{}", id="north")
    assert [camera.name for camera in store.cameras.all()] == ["south"]
    assert store.damaged
