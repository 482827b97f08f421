"""What vanished behind our back: rows and pictures while the server was off, and the folder while it runs."""

import sqlite3
from contextlib import closing

import pytest
from sqlalchemy import text

from tests.support.store_opener import damage_row
from tests.support.store_writer import calibration
from touchline.core.errors import TouchlineError
from touchline.core.geometry import ImageSize
from touchline.detection.store import ClipRepository
from touchline.store.opening import FILE
from touchline.store.store import Store
from touchline.store.tables import ARCHIVED_TABLES, CameraRow

SIZE = ImageSize(640, 480)


def reasons(store):
    return [warning.reason for warning in store.warnings if warning.reason != "disk-nearly-full"]


def fill(store):
    """Something in several tables; the newest lens."""
    store.snapshots.add(b"x", SIZE, "png")
    store.calibrations.activate(store.calibrations.add(calibration("north", "kept")).id)
    store.cameras.add("north", {"source": "sim://table"})
    return [store.lenses.add({"model": "ssl"}) for _ in range(3)][-1]


@pytest.mark.parametrize(
    "vanished",
    [{"lenses": 2, "cameras": 1, "activations": 1}, {"snapshots": 1}],
    ids=lambda vanished: " ".join(vanished),
)
def test_rows_that_vanished_are_named_at_the_next_start_and_a_good_backup_has_them(
    tmp_path, vanished
):
    with Store(tmp_path) as store:
        newest = fill(store)
    with closing(sqlite3.connect(tmp_path / FILE)) as connection:
        for table, count in vanished.items():
            connection.execute(
                f"DELETE FROM {table} WHERE rowid IN (SELECT rowid FROM {table} ORDER BY rowid DESC "
                f"LIMIT {count})"
            )
        connection.commit()
    for _ in range(2):  # a start and a save later they are not forgotten
        with Store(tmp_path) as store:
            (damage,) = store.damaged
            assert damage.file == "quarantine/missing/rows.json" and damage.restorable
            found = (tmp_path / damage.file).read_text()
            assert all(f'"{table}": {count}' in found for table, count in vanished.items())
            store.rigs.add("pair", {"title": "Pair"})
            store.rigs.delete("pair")
            with store._backups.held:
                store._backups.make()
    with Store(tmp_path) as store:
        store.restore_backup()
        assert store.damaged == () and store.lenses.get(newest["id"]) == newest
        assert store.cameras.get("north").body and len(store.snapshots.list().items) == 1
    with Store(tmp_path) as store:
        assert store.damaged == ()


def test_rows_that_vanished_are_named_where_others_are_damaged_too(opener, tmp_path):
    with opener(tmp_path) as store:
        fill(store)
        damage_row(store, CameraRow, lambda body: body.replace("table", "tible"), id="north")
        with store._database.engine.begin() as connection:
            connection.execute(text("DELETE FROM lenses"))
    for _ in range(2):
        with opener(tmp_path) as store:
            assert [damage.kind for damage in store.damaged] == ["cameras", "missing"]


def test_rows_that_vanished_are_forgotten_with_the_file_that_names_them(opener, tmp_path):
    with opener(tmp_path) as store:
        fill(store)
        with store._database.engine.begin() as connection:
            connection.execute(text("DELETE FROM lenses"))
    with opener(tmp_path) as store:
        (damage,) = store.damaged
        (tmp_path / damage.file).unlink()
    for _ in range(2):
        with opener(tmp_path) as store:
            assert store.damaged == ()
            store.lenses.add({"model": "ssl"})
            if opener.on_sqlite:
                with store._backups.held:
                    store._backups.make()
                assert store.find_restoration().lost == 0, (
                    "what is gone for good makes no backup bad"
                )


def test_what_operators_delete_themselves_has_not_vanished(opener, tmp_path):
    with opener(tmp_path) as store:
        lens = fill(store)
        store.lenses.delete(lens["id"])
        store.cameras.delete("north")
    with opener(tmp_path) as store:
        assert store.damaged == () and reasons(store) == []


def test_every_table_is_counted(opener, tmp_path):
    with opener(tmp_path) as store:
        fill(store)
        with store._database.reading() as rows:
            counts = rows.scalar(text("SELECT counts FROM ledger"))
        for table in ARCHIVED_TABLES:
            assert f'"{table.__tablename__}": ' in counts


def test_images_that_vanished_are_counted_until_they_are_put_back(tmp_path):
    with Store(tmp_path) as store:
        gone, there = (store.snapshots.add(data, SIZE, "png") for data in (b"x", b"y"))
        path = store.snapshots.path(gone)
    path.unlink()
    for _ in range(2):
        with Store(tmp_path) as store:
            (warning,) = [one for one in store.warnings if one.reason == "images-missing"]
            assert warning.text.endswith(": 1.") and "Copy them back" in warning.fix
            assert store.snapshots.picture(there.id) == b"y"
            with pytest.raises(TouchlineError) as told:
                store.snapshots.picture(gone.id)
            assert (
                told.value.status == 503 and "quarantine" not in told.value.what and told.value.fix
            )
    path.write_bytes(b"x")
    with Store(tmp_path) as store:
        assert reasons(store) == [] and store.snapshots.picture(gone.id) == b"x"


def test_a_data_folder_that_is_moved_while_it_is_open_is_named_and_refuses_what_it_cannot_save(
    tmp_path,
):
    folder, moved = tmp_path / "data", tmp_path / "moved"
    clip = {"width": 1, "height": 1, "frames": []}
    with Store(folder) as store:
        kept = fill(store)
        folder.rename(moved)
        for work in (
            lambda: store.snapshots.add(b"new", SIZE, "png"),
            lambda: store.disk_usage,
            lambda: store.repository(ClipRepository).add("north", clip, b""),
            store.archive,
        ):
            with pytest.raises(TouchlineError) as told:
                work()
            assert told.value.status == 503 and told.value.fix
        assert reasons(store) == ["data-folder-moved"]
        folder.mkdir()  # somebody has made another one in its place
        assert reasons(store) == ["data-folder-moved"]
        folder.rmdir()
        moved.rename(folder)
        assert "data-folder-moved" not in reasons(store)
    with Store(folder) as store:
        assert store.lenses.get(kept["id"]) == kept
