"""Rigs: kept, changed by one hand at a time, brought along by the archive, on either database."""

import zipfile

import pytest
from sqlalchemy import text

from app.core.errors import BadInput, Conflict, NotFound, Stale
from app.store import rigs
from app.store.restoring import restore_into
from app.store.tables import RigRow
from tests.support.store_opener import damage_row

BODY = {"title": "Hall", "field": "ssl-div-b", "cameras": [{"camera": "north", "region": "half-left", "rotate": None}]}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


def test_a_rig_is_kept_changed_and_removed_and_comes_back_after_a_restart(opener, store):
    made = store.add_rig("hall", BODY, by="Anna")
    store.add_rig("attic", {**BODY, "title": "Attic"})
    assert [rig.name for rig in store.rigs()] == ["hall", "attic"]  # as they were made
    changed = store.save_rig("hall", {**BODY, "title": "Big hall"}, made.etag, by="Ben")
    assert changed.etag != made.etag and (made.updated_by, changed.updated_by) == ("Anna", "Ben")
    store.close()
    with opener(store.folder) as again:
        assert again.rig("hall") == changed
        again.remove_rig("hall", changed.etag)
        assert [rig.name for rig in again.rigs()] == ["attic"]
        with pytest.raises(NotFound):
            again.rig("hall")


def test_a_name_is_given_once(store):
    store.add_rig("hall", BODY)
    with pytest.raises(Conflict) as refused:
        store.add_rig("hall", BODY)
    assert refused.value.reason == "rig-exists"


def test_who_was_slower_neither_overwrites_nor_removes(store):
    first = store.add_rig("hall", BODY)
    store.save_rig("hall", {**BODY, "title": "theirs"}, first.etag)
    for slower in (lambda: store.save_rig("hall", {**BODY, "title": "ours"}, first.etag),
                   lambda: store.remove_rig("hall", first.etag)):
        with pytest.raises(Stale) as refused:
            slower()
        assert refused.value.details["current"]["title"] == "theirs"
    assert store.rig("hall").body["title"] == "theirs"


def test_a_rig_made_anew_under_an_old_name_is_not_overwritten_by_who_knew_the_old_one(store):
    old = store.add_rig("hall", BODY)
    store.remove_rig("hall")
    with pytest.raises(Stale):
        store.save_rig("hall", {**BODY, "title": "ours"}, old.etag)
    store.add_rig("hall", {**BODY, "title": "new"})
    with pytest.raises(Stale):
        store.save_rig("hall", {**BODY, "title": "ours"}, old.etag)
    assert store.rig("hall").body["title"] == "new"


def test_there_are_only_so_many(store, monkeypatch):
    monkeypatch.setattr(rigs, "MAX_RIGS", 2)
    store.add_rig("one", BODY)
    store.add_rig("two", BODY)
    with pytest.raises(Conflict) as refused:
        store.add_rig("three", BODY)
    assert refused.value.reason == "too-many-rigs"


@pytest.mark.parametrize("name", ["../outside", "", ".", "a\0b", "x" * 300, "\ud800", ".hidden"])
def test_a_name_that_nobody_could_give_is_unknown_and_is_not_kept(store, name):
    with pytest.raises(NotFound):
        store.rig(name)
    with pytest.raises(BadInput):
        store.add_rig(name, BODY)
    with pytest.raises(Stale):
        store.save_rig(name, BODY, "1")


def test_a_damaged_rig_is_named_and_hides_no_other(store):
    store.add_rig("hall", BODY)
    store.add_rig("attic", BODY)
    damage_row(store, RigRow, lambda text: "{}", name="hall")
    assert [rig.name for rig in store.rigs()] == ["attic"]
    assert store.damaged


def test_rigs_come_with_the_archive(store, opener, tmp_path):
    store.add_rig("hall", BODY)
    path, bare = tmp_path / "all.zip", tmp_path / "bare"
    path.write_bytes(b"".join(store.archive()))
    assert restore_into(path, bare, opener.address(bare))["rigs"] == 1
    with opener(bare) as again:
        assert again.rigs() == store.rigs()


def test_an_archive_from_before_there_were_rigs_is_still_restored(store, opener, tmp_path):
    store.add_camera("north", {"name": "North"})
    path, old, bare = tmp_path / "all.zip", tmp_path / "old.zip", tmp_path / "bare"
    path.write_bytes(b"".join(store.archive()))
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(old, "w") as out:
        for name in source.namelist():
            if name in ("tables/rigs.jsonl", "tables/rolls.jsonl", "tables/presets.jsonl"):
                continue
            data = source.read(name).decode()
            out.writestr(name, data.replace('"form": "0004"', '"form": "0001"').replace(', "rigs": 0', "")
                         .replace(', "rolls": 0', "").replace(', "presets": 0', ""))
    restore_into(old, bare, opener.address(bare))
    with opener(bare) as again:
        assert [camera.id for camera in again.cameras()] == ["north"] and again.rigs() == ()
        assert again.add_rig("hall", BODY).name == "hall"


def test_a_database_from_before_there_were_rigs_gets_room_for_them(opener, store):
    store.add_camera("north", {"name": "North"})
    with store._database.engine.begin() as connection:
        connection.execute(text("DROP TABLE rigs"))
        connection.execute(text("DROP TABLE rolls"))
        connection.execute(text("DROP TABLE presets"))
        connection.execute(text("UPDATE alembic_version SET version_num = '0001'"))
    with opener.again(store) as again:
        assert [camera.id for camera in again.cameras()] == ["north"]
        assert again.add_rig("hall", BODY).name == "hall"
