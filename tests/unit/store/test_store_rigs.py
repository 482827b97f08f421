"""Rigs: kept, changed by one hand at a time, brought along by the archive, on either database."""

import pytest

from tests.support.store_opener import damage_row
from touchline.core.errors import BadInput, Conflict, NotFound, Stale
from touchline.store.archive import restore_into
from touchline.store.documents import RigRepository
from touchline.store.tables import RigRow

BODY = {
    "title": "Hall",
    "field": "ssl-div-b",
    "cameras": [{"camera": "north", "region": "half-left", "rotate": None}],
}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


def test_a_rig_is_kept_changed_and_removed_and_comes_back_after_a_restart(opener, store):
    made = store.rigs.add("hall", BODY, by="Anna")
    store.rigs.add("attic", {**BODY, "title": "Attic"})
    assert [rig.name for rig in store.rigs.all()] == ["hall", "attic"]  # as they were made
    changed = store.rigs.save("hall", {**BODY, "title": "Big hall"}, made.etag, by="Ben")
    assert changed.etag != made.etag and (made.updated_by, changed.updated_by) == ("Anna", "Ben")
    store.close()
    with opener(store.folder) as again:
        assert again.rigs.get("hall") == changed
        again.rigs.delete("hall", changed.etag)
        assert [rig.name for rig in again.rigs.all()] == ["attic"]
        with pytest.raises(NotFound):
            again.rigs.get("hall")


def test_a_name_is_given_once(store):
    store.rigs.add("hall", BODY)
    with pytest.raises(Conflict) as refused:
        store.rigs.add("hall", BODY)
    assert refused.value.reason == "rig-exists"


def test_who_was_slower_neither_overwrites_nor_removes(store):
    first = store.rigs.add("hall", BODY)
    store.rigs.save("hall", {**BODY, "title": "theirs"}, first.etag)
    for slower in (
        lambda: store.rigs.save("hall", {**BODY, "title": "ours"}, first.etag),
        lambda: store.rigs.delete("hall", first.etag),
    ):
        with pytest.raises(Stale) as refused:
            slower()
        assert refused.value.details["current"]["title"] == "theirs"
    assert store.rigs.get("hall").body["title"] == "theirs"


def test_a_rig_made_anew_under_an_old_name_is_not_overwritten_by_who_knew_the_old_one(store):
    old = store.rigs.add("hall", BODY)
    store.rigs.delete("hall")
    with pytest.raises(Stale):
        store.rigs.save("hall", {**BODY, "title": "ours"}, old.etag)
    store.rigs.add("hall", {**BODY, "title": "new"})
    with pytest.raises(Stale):
        store.rigs.save("hall", {**BODY, "title": "ours"}, old.etag)
    assert store.rigs.get("hall").body["title"] == "new"


def test_there_are_only_so_many(store, monkeypatch):
    monkeypatch.setattr(RigRepository, "max_count", 2)
    store.rigs.add("one", BODY)
    store.rigs.add("two", BODY)
    with pytest.raises(Conflict) as refused:
        store.rigs.add("three", BODY)
    assert refused.value.reason == "too-many-rigs"


@pytest.mark.parametrize("name", ["../outside", "", ".", "a\0b", "x" * 300, "\ud800", ".hidden"])
def test_a_name_that_nobody_could_give_is_unknown_and_is_not_kept(store, name):
    with pytest.raises(NotFound):
        store.rigs.get(name)
    with pytest.raises(BadInput):
        store.rigs.add(name, BODY)
    with pytest.raises(Stale):
        store.rigs.save(name, BODY, "1")


def test_a_damaged_rig_is_named_and_hides_no_other(store):
    store.rigs.add("hall", BODY)
    store.rigs.add("attic", BODY)
    damage_row(store, RigRow, lambda text: "{}", name="hall")
    assert [rig.name for rig in store.rigs.all()] == ["attic"]
    assert store.damaged


def test_rigs_come_with_the_archive(store, opener, tmp_path):
    store.rigs.add("hall", BODY)
    path, bare = tmp_path / "all.zip", tmp_path / "bare"
    path.write_bytes(b"".join(store.archive()))
    assert restore_into(path, bare, opener.address(bare))["rigs"] == 1
    with opener(bare) as again:
        assert again.rigs.all() == store.rigs.all()
