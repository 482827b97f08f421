"""A disk that fails: at every call of a save in turn, the old stands, nothing is half there, and trying again works."""

import errno
import os
from dataclasses import replace
from types import SimpleNamespace

import pytest
from store_writer import calibration

from app.errors import DiskFull, TouchlineError, Unavailable
from app.geometry import ImageSize
from app.store import EMPTY, Store
from app.store.files import write_whole

SIZE = ImageSize(640, 480)
CALLS = ("open", "write", "fsync", "close", "replace")
CODES = {errno.ENOSPC: DiskFull, errno.EDQUOT: DiskFull, errno.EIO: Unavailable, errno.EROFS: Unavailable}


class Disk:
    """The operating system's calls that a save makes, written down; the one numbered fail_at fails instead."""

    def __init__(self, fail_at=None, code=errno.EIO):
        self.calls, self.fail_at, self.code = [], fail_at, code
        for name in CALLS:
            setattr(self, name, self._watched(name))

    def __getattr__(self, name):
        return getattr(os, name)

    def _watched(self, name):
        def call(*args, **more):
            self.calls.append(name)
            if len(self.calls) - 1 == self.fail_at:
                if name == "close":
                    os.close(*args)  # the system lets go of the handle even then
                raise OSError(self.code, os.strerror(self.code))
            return getattr(os, name)(*args, **more)
        return call


def save_snapshot(store, known):
    store.add_snapshot(b"another", SIZE, "png")


def save_draft(store, known):
    store.save_draft(known.snapshot, {**EMPTY, "field": "new"}, store.draft(known.snapshot).etag)


def save_calibration(store, known):
    store.save(calibration("north", "new"))


def activate(store, known):
    store.activate(known.second)


def delete(store, known):
    store.delete_calibration(known.second)


SAVES = [save_snapshot, save_draft, save_calibration, activate, delete]


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "data") as store:
        yield store


@pytest.fixture
def known(store):
    snapshot = store.add_snapshot(b"one", SIZE, "png").id
    store.save_draft(snapshot, {**EMPTY, "field": "old"}, store.draft(snapshot).etag)
    first, second = (store.save(calibration("north", note)).id for note in "12")
    store.activate(first)
    return SimpleNamespace(snapshot=snapshot, first=first, second=second)


def state(store):
    return ([s.id for s in store.snapshots().items], [store.draft(s.id).body for s in store.snapshots().items],
            [(c.id, c.version, c.active, c.note) for c in store.calibrations().items], store.damaged)


def faulty(monkeypatch, disk):
    monkeypatch.setattr("app.store.files.os", disk)


@pytest.mark.parametrize("code", CODES, ids=lambda code: errno.errorcode[code])
@pytest.mark.parametrize("save", SAVES)
def test_whichever_call_of_a_save_fails_it_is_told_and_nothing_is_lost(store, known, save, code):
    before = state(store)
    for k in range(50):
        with pytest.MonkeyPatch.context() as patch:
            disk = Disk(fail_at=k, code=code)
            faulty(patch, disk)
            try:
                save(store, known)
            except TouchlineError as told:
                assert isinstance(told, CODES[code]) and "not saved" in told.what and told.fix
            else:
                assert len(disk.calls) <= k, "the failure of a call went unnoticed"
                break
        assert not [path for path in store.folder.rglob("*.tmp")]
        if "replace" not in disk.calls:
            assert state(store) == before
        assert store.damaged == () and store.calibration(known.first).note == "1"
    assert 4 <= k < 49
    now = state(store)
    assert now != before
    store.close()
    with Store(store.folder) as again:
        versions = [version for _, version, _, _ in state(again)[2]]
        assert again.damaged == () and len(versions) == len(set(versions))
        assert [c for c in state(again)[2] if c[0] in (known.first,)] == [c for c in now[2] if c[0] in (known.first,)]


def test_a_write_is_flushed_before_it_is_moved_and_its_folder_after(tmp_path, monkeypatch):
    disk = Disk()
    faulty(monkeypatch, disk)
    write_whole(tmp_path / "file", b"data")
    assert disk.calls == ["open", "write", "fsync", "close", "replace", "open", "fsync", "close"]


def test_a_disk_that_takes_a_byte_at_a_time_still_gets_them_all(tmp_path, monkeypatch):
    disk = Disk()
    disk.write = lambda handle, data: os.write(handle, bytes(data[:1]))
    faulty(monkeypatch, disk)
    write_whole(tmp_path / "file", b"every byte")
    assert (tmp_path / "file").read_bytes() == b"every byte"


def test_a_full_disk_is_507_and_the_folder_works_again_once_there_is_space(store, known):
    with pytest.MonkeyPatch.context() as patch:
        faulty(patch, Disk(fail_at=1, code=errno.ENOSPC))
        with pytest.raises(DiskFull) as told:
            save_draft(store, known)
    assert told.value.status == 507 and store.draft(known.snapshot).body["field"] == "old"
    save_draft(store, known)
    assert store.draft(known.snapshot).body["field"] == "new"


def test_a_version_whose_saving_failed_late_does_not_share_its_number(store, known):
    with pytest.MonkeyPatch.context() as patch:
        faulty(patch, Disk(fail_at=6))  # the flush of the folder: the file is there, though nobody was told so
        with pytest.raises(Unavailable):
            save_calibration(store, known)
    assert store.save(calibration("north", "next")).version == 4
    store.close()
    with Store(store.folder) as again:
        assert [c.version for c in again.calibrations().items] == [4, 3, 2, 1]
        assert replace(again.calibration(known.first), active=False).note == "1"
