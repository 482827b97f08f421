"""One server a PostgreSQL: whichever way two come to it, one of them saves and the other says that it does not."""

import threading

import pytest

from tests.support.store_writer import calibration
from tests.support.tiers import rounds
from tests.support.waiting import until
from touchline.core.errors import TouchlineError, Unavailable
from touchline.core.geometry import ImageSize
from touchline.store.store import Store

LOCK = "touchline.store.lock."


def refused(work) -> str:
    with pytest.raises(Unavailable) as told:
        work()
    assert told.value.fix
    return told.value.reason


@pytest.fixture
def address(postgres, tmp_path):
    return postgres.database(tmp_path)


def restart(postgres):
    postgres.stop()
    postgres.start()


def test_a_server_that_lives_through_a_restart_of_postgresql_keeps_the_database(
    postgres, address, tmp_path, monkeypatch
):
    monkeypatch.setattr(LOCK + "WAIT_S", 0.2)
    with Store(tmp_path / "a", database=address) as store:
        store.calibrations.add(calibration("north", "1"))
        restart(postgres)
        assert refused(lambda: Store(tmp_path / "b", database=address)) == "data-folder-in-use"
        assert (
            store.calibrations.add(calibration("north", "2")).version == 2 and store.warnings == ()
        )


def test_whoever_lost_the_database_meanwhile_saves_nothing_and_says_so(
    postgres, address, tmp_path, monkeypatch
):
    monkeypatch.setattr(LOCK + "KEEP_S", 3600.0)  # held up longer than the other one waits
    monkeypatch.setattr(LOCK + "GRACE_S", 0.1)
    with Store(tmp_path / "a", database=address) as first:
        first.calibrations.add(calibration("north", "1"))
        restart(postgres)
        with Store(tmp_path / "b", database=address) as second:
            assert second.calibrations.add(calibration("north", "2")).version == 2
            assert (
                refused(lambda: first.calibrations.add(calibration("north", "lost"))) == "read-only"
            )
            assert [w.reason for w in first.warnings] == ["read-only"]
            assert len(first.calibrations.list("north").items) == 2, "what is there can be read"
            assert (
                second.calibrations.add(calibration("north", "3")).version == 3
                and second.warnings == ()
            )
        assert refused(lambda: first.calibrations.add(calibration("north", "lost"))) == "read-only"
        # it signed off, and the first one is no hindrance
        with Store(tmp_path / "b", database=address) as second:
            assert len(second.calibrations.list("north").items) == 3
    with Store(tmp_path / "a", database=address) as first:
        assert first.calibrations.add(calibration("north", "4")).version == 4


def test_a_server_that_was_held_up_learns_it_without_a_save(
    postgres, address, tmp_path, monkeypatch
):
    monkeypatch.setattr(LOCK + "KEEP_S", 0.05)
    with Store(tmp_path / "a", database=address) as first:
        first._database_lock._mutex.acquire()  # as long as its process stands still
        monkeypatch.setattr(LOCK + "GRACE_S", 0.1)
        restart(postgres)
        with Store(tmp_path / "b", database=address):
            first._database_lock._mutex.release()
            until(lambda: [w.reason for w in first.warnings] == ["read-only"])


def test_who_signs_off_is_followed_at_once_and_who_does_not_after_a_while(
    address, tmp_path, monkeypatch
):
    slept = []
    monkeypatch.setattr(LOCK + "sleep", slept.append)
    Store(tmp_path / "a", database=address).close()
    assert slept == []
    store = Store(tmp_path / "a", database=address)
    monkeypatch.setattr(store._database_lock, "_enter", lambda *_: None)
    store.close()  # as a kill leaves it
    Store(tmp_path / "a", database=address).close()
    assert slept == [3.0]


def test_a_folder_without_pictures_does_not_belong_to_a_database_that_knows_some(address, tmp_path):
    with Store(tmp_path / "a", database=address) as store:
        store.snapshots.add(b"a picture", ImageSize(4, 4), "png")
    assert refused(lambda: Store(tmp_path / "b", database=address)) == "pictures-missing"
    (tmp_path / "b" / "pictures").mkdir()
    # its pictures are lost, and whoever says so goes on
    with Store(tmp_path / "b", database=address) as store:
        assert len(store.snapshots.list().items) == 1


@rounds("times", 1, 10)
def test_postgresql_ended_under_load_loses_nothing_that_was_said_to_be_saved(
    postgres, address, tmp_path, times
):
    ended, saved, told = threading.Event(), [], []

    def save(camera):
        while not ended.is_set():
            try:
                saved.append(store.calibrations.add(calibration(camera, "")).id)
            except TouchlineError as error:
                told.append(error.reason)

    with Store(tmp_path / "a", database=address) as store:
        threads = [threading.Thread(target=save, args=(camera,)) for camera in ("north", "south")]
        for thread in threads:
            thread.start()
        for _ in range(times):
            before = len(saved)
            until(lambda before=before: len(saved) >= before + 20)
            restart(postgres)
        ended.set()
        for thread in threads:
            thread.join()
        there = [store.calibrations.get(id) for id in saved]
    assert len({(one.camera, one.version) for one in there}) == len(saved) and set(told) == {
        "database-away"
    }
