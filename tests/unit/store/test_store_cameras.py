"""Cameras that operators added, and the evidence of which camera an id means."""

import pytest

from app.core.errors import BadInput, Conflict, NotFound, Stale
from app.store.tables import CameraRow
from tests.support.store_opener import damage_row

BODY = {"name": "North half", "source": "rtsp://10.0.0.5/live", "field": "ssl-div-b", "region": "half-left"}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


def test_a_camera_is_kept_changed_and_removed_and_comes_back_after_a_restart(opener, store):
    added = store.add_camera("north", BODY)
    store.add_camera("a-south", {**BODY, "name": "South"})
    assert [camera.id for camera in store.cameras()] == ["north", "a-south"]  # as they were added
    changed = store.save_camera("north", {**BODY, "name": "North"}, added.etag)
    assert changed.etag != added.etag and changed.body["name"] == "North"
    store.close()
    with opener(store.folder) as again:
        assert again.camera("north") == changed
        again.remove_camera("north", changed.etag)
        assert [camera.id for camera in again.cameras()] == ["a-south"]
        with pytest.raises(NotFound):
            again.camera("north")


def test_an_id_is_given_once(store):
    store.add_camera("north", BODY)
    with pytest.raises(Conflict) as refused:
        store.add_camera("north", BODY)
    assert refused.value.reason == "camera-exists"


def test_who_was_slower_neither_overwrites_nor_removes(store):
    first = store.add_camera("north", BODY)
    store.save_camera("north", {**BODY, "name": "theirs"}, first.etag)
    for slower in (lambda: store.save_camera("north", {**BODY, "name": "ours"}, first.etag),
                   lambda: store.remove_camera("north", first.etag)):
        with pytest.raises(Stale) as refused:
            slower()
        assert refused.value.details["current"]["name"] == "theirs"
    assert store.camera("north").body["name"] == "theirs"


def test_the_evidence_of_a_camera_is_kept_for_any_id_and_goes_with_it(opener, store):
    assert store.camera_identity("from-settings") is None
    store.confirm_identity("from-settings", {"serial": "A1"})
    store.confirm_identity("from-settings", {"serial": "B2"})
    store.add_camera("north", BODY)
    store.confirm_identity("north", {"serial": "C3"})
    store.close()
    with opener(store.folder) as again:
        assert again.camera_identity("from-settings") == {"serial": "B2"}
        again.remove_camera("north")
        assert again.camera_identity("north") is None


@pytest.mark.parametrize("id", ["../outside", "/etc/outside", "", ".", "a\0b", "x" * 300, "\ud800", ".hidden"])
def test_an_id_that_nobody_could_have_is_unknown_and_is_not_kept(store, id):
    with pytest.raises(NotFound):
        store.camera(id)
    assert store.camera_identity(id) is None
    for refused in (lambda: store.confirm_identity(id, {"serial": "A1"}), lambda: store.add_camera(id, BODY)):
        with pytest.raises(BadInput):
            refused()


def test_a_damaged_definition_is_named_and_hides_no_other(store):
    store.add_camera("north", BODY)
    store.add_camera("south", BODY)
    damage_row(store, CameraRow, lambda text: "{}", id="north")
    assert [camera.id for camera in store.cameras()] == ["south"]
    assert store.damaged
