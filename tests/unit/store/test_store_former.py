"""A data folder from before there was a database is taken over: nothing is lost, nothing is deleted."""

from dataclasses import replace

import pytest

from app.core.errors import NotFound
from app.store import DamagedFile
from app.store.former import FOLDERS
from tests.support.former_folder import DRAFT, PICTURE, SNAPSHOT, former_folder, name_of
from tests.support.store_opener import count_rows
from tests.support.store_writer import calibration


@pytest.fixture
def former(tmp_path):
    """The folder, its calibrations and its lens."""
    folder = tmp_path / "data"
    kept, lens = former_folder(folder, lambda id, camera, version: replace(
        calibration(camera, f"note {id}"), id=id, version=version, created_at="2026-01-01T00:00:00.000Z"))
    return folder, kept, lens


def test_everything_that_was_in_files_is_in_the_database_and_the_files_are_kept_aside(opener, former):
    folder, (first, deleted, nobodys, newest), lens = former
    for _ in range(2):  # a second start takes over nothing twice
        with opener(folder) as store:
            assert store.snapshot(SNAPSHOT["id"]).to_json() == {**SNAPSHOT, "purpose": "picture"}
            assert store.picture(SNAPSHOT["id"]) == PICTURE
            draft = store.draft(SNAPSHOT["id"])
            assert (draft.body, draft.revision, draft.updated_at) == (DRAFT, 7, "2026-01-02T00:00:00.000Z")
            assert store.calibration(first.id) == first
            assert [c.id for c in store.calibrations().items] == [newest.id, nobodys.id, first.id]
            with pytest.raises(NotFound):
                store.calibration(deleted.id)
            assert store.active("north") == newest.activated(True) and store.active(None) == nobodys.activated(True)
            assert store.lens(lens["id"]) == lens
            assert [(c.id, c.sequence, c.revision, c.body["name"]) for c in store.cameras()] == [("west", 2, 4, "West")]
            assert store.camera_identity("west") == {"serial": "A1"}
            assert store.damaged == ()
            counted = count_rows(store)
        assert counted["calibrations"] == 4 and counted["activations"] == 2
    assert not any((folder / name).exists() for name in FOLDERS)
    assert len(list((folder / "former" / "calibrations").iterdir())) == 3


def test_numbers_go_on_where_the_files_had_come_to(opener, former):
    folder, _, _ = former
    with opener(folder) as store:
        assert store.save(calibration("north", "next")).version == 4
        new = store.add_snapshot(b"new", store.snapshot(SNAPSHOT["id"]).size, "png")
        assert [s.id for s in store.snapshots().items] == [new.id, SNAPSHOT["id"]]
        assert store.add_camera("east", {"name": "East"}).sequence == 3


def test_a_kill_between_the_database_and_the_moving_of_the_files_is_made_good(opener, former, monkeypatch):
    folder, kept, _ = former
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        def killed(path, target):
            raise KeyboardInterrupt
        patch.setattr("app.store.former.move_whole", killed)
        opener(folder)
    assert (folder / "calibrations").is_dir()
    with opener(folder) as store:
        assert count_rows(store)["calibrations"] == 4 and store.active("north").id == kept[3].id
    assert not (folder / "calibrations").exists()


def test_a_damaged_record_keeps_its_number_and_is_named(opener, former):
    folder, kept, _ = former
    path = folder / "calibrations" / name_of(4, kept[3])
    path.write_bytes(path.read_bytes()[:-9])
    with opener(folder) as store:
        assert [d.kind for d in store.damaged] == ["calibrations"]
        with pytest.raises(DamagedFile):
            store.calibration(kept[3].id)
        with pytest.raises(DamagedFile):
            store.active("north")
        assert store.save(calibration("north", "next")).version == 4
