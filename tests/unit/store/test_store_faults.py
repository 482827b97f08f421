"""A disk that fails: at every call of a save in turn, the old stands, nothing is half there, and trying again works."""

import errno
import os
from types import SimpleNamespace

import pytest

from tests.support.failing_disk import Disk, FailingSqlite, can_fail, failing
from tests.support.store_writer import calibration
from touchline.core.errors import DiskFull, TouchlineError, Unavailable
from touchline.core.geometry import ImageSize
from touchline.store.files import write_atomically
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store

SIZE = ImageSize(640, 480)
CODES = {
    errno.ENOSPC: DiskFull,
    errno.EDQUOT: DiskFull,
    errno.EIO: Unavailable,
    errno.EROFS: Unavailable,
}


def save_snapshot(store, known):
    store.snapshots.add(b"another", SIZE, "png")


def save_draft(store, known):
    store.drafts.save(
        known.snapshot, {**EMPTY, "field": "new"}, store.drafts.get(known.snapshot).etag
    )


def save_calibration(store, known):
    store.calibrations.add(calibration("north", "new"))


def activate(store, known):
    store.calibrations.activate(known.second)


def delete(store, known):
    store.calibrations.delete(known.second)


def add_camera(store, known):
    store.cameras.add(f"camera-{len(store.cameras.all())}", {"name": "North"})


def keep_lens(store, known):
    store.lenses.add({"model": "ssl"})


SAVES = [add_camera, keep_lens, save_snapshot, save_draft, save_calibration, activate, delete]


@pytest.fixture(scope="module")
def sqlite():
    if not can_fail():
        pytest.skip("Python brings a SQLite of its own here: its writes cannot be made to fail")
    layer = FailingSqlite()
    yield layer
    layer.remove()


@pytest.fixture
def store(sqlite, tmp_path):
    with Store(tmp_path / "data") as store:
        yield store


@pytest.fixture
def known(store):
    snapshot = store.snapshots.add(b"one", SIZE, "png").id
    store.drafts.save(snapshot, {**EMPTY, "field": "old"}, store.drafts.get(snapshot).etag)
    first, second = (store.calibrations.add(calibration("north", note)).id for note in "12")
    store.calibrations.activate(first)
    return SimpleNamespace(snapshot=snapshot, first=first, second=second)


def state(store):
    return (
        [s.id for s in store.snapshots.list().items],
        [store.drafts.get(s.id).body for s in store.snapshots.list().items],
        [(c.id, c.version, c.active, c.note) for c in store.calibrations.list().items],
        store.damaged,
        store.lenses.list().items,
        store.cameras.all(),
    )


@pytest.mark.parametrize("code", CODES, ids=lambda code: errno.errorcode[code])
@pytest.mark.parametrize("save", SAVES)
def test_whichever_call_of_a_save_fails_it_is_told_and_nothing_is_lost(
    sqlite, store, known, save, code
):
    before = state(store)
    for k in range(50):
        with failing(pytest.MonkeyPatch.context, sqlite, Disk(fail_at=k, code=code)) as disk:
            try:
                save(store, known)
            except TouchlineError as told:
                assert isinstance(told, CODES[code]) and "not saved" in told.what and told.fix
            else:
                assert len(disk.calls) <= k, "the failure of a call went unnoticed"
                break
            assert state(store) == before, "while the disk fails, the old is read"
        assert not [path for path in (store.folder / "pictures").glob(".*")]
        assert (
            state(store) == before
            and store.damaged == ()
            and store.calibrations.get(known.first).note == "1"
        )
    assert 3 <= k < 49
    assert "sqlite write" in disk.calls and "sqlite sync" in disk.calls
    now = state(store)
    assert now != before
    store.close()
    with Store(store.folder) as again:
        assert state(again) == now, "what was acknowledged is what a restart finds"


def test_a_write_is_flushed_before_it_is_moved_and_its_folder_after(tmp_path, monkeypatch):
    disk = Disk()
    monkeypatch.setattr("touchline.store.files.os", disk)
    write_atomically(tmp_path / "file", b"data")
    assert disk.calls == ["open", "write", "fsync", "close", "replace", "open", "fsync", "close"]


def test_a_disk_that_takes_a_byte_at_a_time_still_gets_them_all(tmp_path, monkeypatch):
    disk = Disk()
    disk.write = lambda handle, data: os.write(handle, bytes(data[:1]))
    monkeypatch.setattr("touchline.store.files.os", disk)
    write_atomically(tmp_path / "file", b"every byte")
    assert (tmp_path / "file").read_bytes() == b"every byte"


def test_a_full_disk_is_507_and_the_folder_works_again_once_there_is_space(sqlite, store, known):
    with failing(pytest.MonkeyPatch.context, sqlite, Disk(fail_at=0, code=errno.ENOSPC)):
        with pytest.raises(DiskFull) as told:
            save_draft(store, known)
        assert told.value.status == 507 and store.drafts.get(known.snapshot).body["field"] == "old"
    save_draft(store, known)
    assert store.drafts.get(known.snapshot).body["field"] == "new"


def test_every_commit_is_flushed_before_it_is_acknowledged(sqlite, store, known):
    with failing(pytest.MonkeyPatch.context, sqlite, Disk()) as disk:
        save_calibration(store, known)
    assert disk.calls[-1] == "sqlite sync" and "sqlite write" in disk.calls
    with store._database.engine.connect() as connection:
        asked = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    # 2: FULL
    assert asked == {
        "journal_mode": "wal",
        "synchronous": 2,
        "foreign_keys": 1,
        "busy_timeout": 5000,
    }
