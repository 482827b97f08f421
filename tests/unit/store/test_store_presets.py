"""Presets: kept by kind and name, never written over unseen, brought along by the archive, on either database."""

import pytest

from tests.support.store_opener import damage_row
from touchline.core.errors import BadInput, Conflict, NotFound, Stale
from touchline.store.archive import restore_into
from touchline.store.documents import DocumentRepository
from touchline.store.tables import PresetRow

HALL = {"name": "hall", "colours": {"orange": [{"rgb": [250, 112, 30]}]}}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        yield opened


def test_what_was_kept_survives_a_restart_each_kind_for_itself(opener, store):
    kept = store.colour_profiles.save("hall", HALL, None, "Ann")
    store.detection_plans.save("hall", {"on": False}, None)
    with opener.again(store) as again:
        assert again.colour_profiles.get("hall") == kept and kept.updated_by == "Ann"
        assert [one.name for one in again.colour_profiles.all()] == ["hall"]
        assert again.detection_plans.get("hall").body == {"on": False}


def test_it_is_changed_only_by_who_has_seen_the_newest_state(store):
    first = store.colour_profiles.save("hall", HALL, None)
    second = store.colour_profiles.save("hall", {**HALL, "reach": 2.0}, first.etag)
    with pytest.raises(Stale) as refused:
        store.colour_profiles.save("hall", HALL, first.etag)
    assert (
        refused.value.details["etag"] == second.etag
        and refused.value.details["current"]["reach"] == 2.0
    )
    with pytest.raises(Conflict) as refused:
        store.colour_profiles.save("hall", HALL, None)
    assert refused.value.reason == "colours-exists"
    with pytest.raises(Stale):
        store.colour_profiles.delete("hall", first.etag)
    store.colour_profiles.delete("hall", second.etag)
    with pytest.raises(NotFound) as refused:
        store.colour_profiles.get("hall")
    assert refused.value.reason == "unknown-colours"
    with pytest.raises(Stale):
        store.colour_profiles.save("hall", HALL, second.etag)


@pytest.mark.parametrize("name", ["", "a/b", "\0", "x" * 65, "ä"])
def test_a_name_that_could_be_a_path_is_refused(store, name):
    with pytest.raises(BadInput):
        store.colour_profiles.save(name, HALL, None)
    with pytest.raises(NotFound):
        store.colour_profiles.get(name)


def test_there_is_an_end_to_how_many_are_kept(store, monkeypatch):
    monkeypatch.setattr(DocumentRepository, "max_count", 1)
    store.colour_profiles.save("one", HALL, None)
    store.detection_plans.save("one", {}, None)
    with pytest.raises(Conflict) as refused:
        store.colour_profiles.save("two", HALL, None)
    assert refused.value.reason == "too-many-colours"


def test_a_damaged_one_hides_no_other_and_is_not_written_over(store):
    for name in ("one", "two"):
        store.colour_profiles.save(name, HALL, None)
    damage_row(store, PresetRow, lambda text: "{}", key="colours:one")
    assert [one.name for one in store.colour_profiles.all()] == ["two"] and store.damaged
    with pytest.raises(Exception, match="damaged"):
        store.colour_profiles.save("one", HALL, None)


def test_the_archive_brings_presets_along(store, opener, tmp_path):
    store.colour_profiles.save("hall", HALL, None)
    path, bare = tmp_path / "all.zip", tmp_path / "bare"
    path.write_bytes(b"".join(store.archive()))
    assert restore_into(path, bare, opener.address(bare))["presets"] == 1
    with opener(bare) as again:
        assert again.colour_profiles.all() == store.colour_profiles.all()
