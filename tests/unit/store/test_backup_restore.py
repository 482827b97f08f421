"""The newest good backup takes the place of a database with damaged rows: when asked for, whole, and nothing lost."""

import errno
import os
import shutil
import sqlite3
import threading
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.support.store_opener import break_database, damage_row
from tests.support.store_writer import calibration
from tests.support.waiting import LONG_S, until
from touchline.core.errors import Conflict, DiskFull, TouchlineError, Unavailable
from touchline.store import opening
from touchline.store.opening import FILE, UNFINISHED
from touchline.store.quarantine import DamagedFile
from touchline.store.store import Store
from touchline.store.tables import CalibrationRow

STEPS = (
    "shutil.copyfile",
    "is_whole",
    "sqlite3.connect",
    "Replaced.add",
    "remove_database",
    "replace_synced",
    "Quarantine.move_rows",
)


@pytest.fixture
def damaged(tmp_path):
    """A data folder with a good backup, a row that was damaged after it, and a save after that; and what was where."""
    with Store(tmp_path / "data") as store:
        kept = store.calibrations.add(calibration("north", "kept"))
        kept = store.calibrations.activate(kept.id)
    good = max(path.name for path in (tmp_path / "data" / "backups").iterdir())
    with Store(tmp_path / "data") as store:
        damage_row(store, CalibrationRow, lambda text: text.replace("kept", "lept"), id=kept.id)
        newer = store.calibrations.add(calibration("north", "newer"))
    return SimpleNamespace(
        folder=tmp_path / "data", kept=kept, newer=newer, backup=int(good.partition(".")[0])
    )


def notes(store):
    """What is in the store: the notes of its versions, "damaged" in place of one that is."""
    return {one.note for one in store.calibrations.list().items} | (
        {"damaged"} if not whole(store) else set()
    )


def whole(store):
    return not any(damage.restorable for damage in store.damaged)


def test_the_newest_backup_without_damage_is_restored_and_the_database_from_before_is_kept(damaged):
    with Store(damaged.folder) as store:
        with pytest.raises(DamagedFile) as told:
            store.calibrations.get(damaged.kept.id)
        assert "newest good backup" in told.value.fix and notes(store) == {"newer", "damaged"}
        found = store.find_restoration()
        assert (found.backup, found.file) == (damaged.backup, None) and found.lost >= 1
        assert (
            notes(store) == {"newer", "damaged"} and not (damaged.folder / UNFINISHED).exists()
        ), "nothing was done"
        done = store.restore_backup((found.backup, found.database))
        assert (done.backup, done.lost, done.made_at) == (found.backup, found.lost, found.made_at)
        assert store.calibrations.get(damaged.kept.id) == damaged.kept and notes(store) == {"kept"}
        assert store.calibrations.active("north").id == damaged.kept.id
        assert store.damaged == () and store.disk_usage["replaced"] == [done.file]
        with closing(sqlite3.connect(damaged.folder / done.file)) as before:
            assert before.execute("SELECT count(*) FROM calibrations").fetchone() == (2,)
        rest = [
            path.read_text() for path in (damaged.folder / done.file).parent.glob("calibrations/*")
        ]
        assert len(rest) == 1 and "lept" in rest[0], "with what was left of the damaged row"
        again = store.calibrations.add(calibration("north", "again"))
        assert again.version == 2
    with Store(damaged.folder) as store:
        assert notes(store) == {"kept", "again"} and store.damaged == (), (
            "no backup from before is newer"
        )
        assert store.find_restoration().lost == 0


def test_without_a_good_backup_it_is_refused_and_nothing_changes(damaged):
    for path in (damaged.folder / "backups").iterdir():
        if int(path.name.partition(".")[0]) <= damaged.backup:
            path.unlink()
    with Store(damaged.folder) as store:
        for call in (store.find_restoration, store.restore_backup):
            with pytest.raises(Conflict) as told:
                call()
            assert told.value.reason == "no-good-backup" and "archive" in told.value.fix
        assert (
            notes(store) == {"newer", "damaged"}
            and store.calibrations.add(calibration("north", "3")).version == 3
        )
        assert [damage.kind for damage in store.damaged] == ["calibrations"]


def test_postgresql_has_backups_of_its_own(postgres, tmp_path):
    with Store(tmp_path / "data", database=postgres.database(tmp_path / "data")) as store:
        for call in (store.find_restoration, store.restore_backup):
            with pytest.raises(Conflict) as told:
                call()
            assert told.value.reason == "no-own-backups" and "pg_restore" in told.value.fix


def test_of_two_at_once_one_restores_and_the_other_is_refused(damaged):
    with Store(damaged.folder) as store:
        found = store.find_restoration()
        told = []

        def restore():
            try:
                told.append(store.restore_backup((found.backup, found.database)).file)
            except Conflict as refused:
                told.append(refused.reason)

        both = [threading.Thread(target=restore) for _ in range(2)]
        for one in both:
            one.start()
        for one in both:
            one.join(LONG_S)
        assert set(told) == {"changed-meanwhile", f"replaced/{found.database:012d}/{FILE}"}
        assert notes(store) == {"kept"} and store.restored == 1


def test_who_restores_wins_against_those_who_save_and_their_saves_are_in_the_copy(damaged):
    with Store(damaged.folder) as store:
        found = store.find_restoration()
        store.calibrations.add(calibration("north", "a moment ago"))
        done = store.restore_backup((found.backup, found.database))
        assert notes(store) == {"kept"} and done.lost == found.lost + 1
        with closing(sqlite3.connect(damaged.folder / done.file)) as before:
            (bodies,) = before.execute("SELECT group_concat(body) FROM calibrations").fetchone()
        assert "a moment ago" in bodies
        store.calibrations.add(calibration("north", "since"))
        for stale in ((found.backup, found.database), (found.backup - 1, found.database)):
            with pytest.raises(Conflict) as told:
                store.restore_backup(stale)
            assert told.value.reason in ("changed-meanwhile", "no-good-backup")
        assert notes(store) == {"kept", "since"}, (
            "what somebody else has restored meanwhile is not restored again"
        )


def test_of_thirty_restores_three_databases_stay_and_no_damage_is_told(damaged):
    with Store(damaged.folder) as store:
        for number in range(30):
            done = store.restore_backup()
            store.calibrations.add(calibration("north", str(number)))
        kept = store.disk_usage["replaced"]
        assert store.damaged == () and len(kept) == 3 and kept[0] == done.file
        assert sorted(path.name for path in (damaged.folder / "replaced").iterdir()) == sorted(
            Path(file).parent.name for file in kept
        )


@pytest.mark.parametrize("first_byte", [0, 4096], ids=["all", "all but its first page"])
def test_a_database_that_is_damaged_while_it_runs_is_told_to_all_and_replaced_without_reading_it(
    tmp_path, first_byte
):
    with Store(tmp_path / "data") as store:
        kept = store.calibrations.add(calibration("north", "kept"))
        with store._backups.held:
            store._backups.make()
        before = break_database(store, first_byte)
        for work in (
            store.calibrations.list,
            lambda: store.lenses.add({"model": "ssl"}),
            store.archive,
        ):
            with pytest.raises(Unavailable) as told:
                work()
            assert (
                told.value.reason == "database-damaged" and "newest good backup" in told.value.fix
            )
        (warning,) = [one for one in store.warnings if one.reason == "database-damaged"]
        assert "damaged" in warning.text
        found = store.find_restoration()
        done = store.restore_backup((found.backup, found.database))
        assert store.calibrations.get(kept.id) == kept and store.damaged == ()
        assert not [one for one in store.warnings if one.reason == "database-damaged"]
        assert store.calibrations.add(calibration("north", "again")).version == 2
        assert (tmp_path / "data" / done.file).read_bytes() == before
    with Store(tmp_path / "data") as store:
        assert notes(store) == {"kept", "again"} and store.damaged == ()


@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("step", STEPS)
def test_a_power_cut_at_any_step_leaves_the_old_database_or_the_new_one(
    damaged, tmp_path, monkeypatch, step, after
):
    """The folder as it is at every call of the step is what the next start finds."""
    images = []

    def cut(*args, **more):
        if after:
            answer = real(*args, **more)
        image = tmp_path / f"cut{len(images)}"
        shutil.copytree(
            damaged.folder,
            image,
            copy_function=lambda source, target: Path(target).write_bytes(
                Path(source).read_bytes()
            ),
        )
        images.append((image, database.stat().st_ino != old))
        return answer if after else real(*args, **more)

    owner, _, name = step.rpartition(".")
    owner = getattr(opening, owner) if owner else opening
    real, database = getattr(owner, name), damaged.folder / FILE
    with Store(damaged.folder) as store:
        old = database.stat().st_ino
        until(
            lambda: store._backups.all()[0].changes,
            lambda newest: newest == store._database.changes(),
        )
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, cut)
            store.restore_backup()
    assert images
    for image, is_replaced in images:
        with Store(image) as store:
            if is_replaced:  # the report stays until it was moved as well
                assert notes(store) - {"damaged"} == {"kept"}
            else:
                assert notes(store) == {"newer", "damaged"}
            assert not (image / UNFINISHED).exists()
            assert {damage.kind for damage in store.damaged} <= {"calibrations"}, (
                "no other backup was restored"
            )


@pytest.mark.parametrize("step", STEPS[:-1])
def test_an_error_at_any_step_leaves_the_old_database_in_use(damaged, monkeypatch, step):
    def fail(*_args, **_more):
        raise (
            sqlite3.OperationalError("")
            if "sqlite3" in step
            else OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        )

    owner, _, name = step.rpartition(".")
    with Store(damaged.folder) as store:
        with monkeypatch.context() as patch, pytest.raises((TouchlineError, OSError)) as told:
            patch.setattr(getattr(opening, owner) if owner else opening, name, fail)
            store.restore_backup()
        if step in ("shutil.copyfile", "Replaced.add", "replace_synced"):
            assert isinstance(told.value, DiskFull) and told.value.fix
        assert notes(store) == {"newer", "damaged"} and store.restored == 0
        assert store.calibrations.add(calibration("north", "3")).version == 3
        assert store.restore_backup().backup == damaged.backup and "kept" in notes(store)


def test_whoever_reads_or_saves_meanwhile_waits_and_goes_on(damaged, monkeypatch):
    errors, stop, swapping = [], threading.Event(), threading.Event()
    real = opening.replace_synced

    def slow(path, target):
        swapping.set()
        stop.wait(0.3)
        real(path, target)

    def use(work):
        while not stop.is_set():
            try:
                work()
            except DamagedFile:
                pass
            except Exception as error:
                errors.append(error)

    monkeypatch.setattr(opening, "replace_synced", slow)
    with Store(damaged.folder) as store:
        saved = []
        users = [
            threading.Thread(target=use, args=(lambda: store.calibrations.list(),))
            for _ in range(12)
        ]
        users.append(
            threading.Thread(
                target=use,
                args=(
                    lambda: saved.append(
                        (swapping.is_set(), store.lenses.add({"model": "ssl"})["id"])
                    ),
                ),
            )
        )
        for one in users:
            one.start()
        store.restore_backup()
        until(lambda: len([lens for since, lens in saved if since]), lambda count: count > 2)
        stop.set()
        for one in users:
            one.join(LONG_S)
        assert not errors
        # the first may have been saved just before
        since = [lens for was_swapping, lens in saved if was_swapping][1:]
        assert {lens["id"] for lens in store.lenses.list(limit=200).items} >= {*since}
        assert notes(store) == {"kept"}


def test_while_rows_are_damaged_no_older_backup_makes_room_for_newer_ones(damaged):
    with Store(damaged.folder) as store:
        for number in range(20):
            store.calibrations.add(calibration("north", str(number)))
            with store._backups.held:
                store._backups.make()
        assert store.find_restoration().backup == damaged.backup
        store.restore_backup()
        with store._backups.held:
            store._backups.make()
        assert len(store._backups.all()) <= 14, "then they make room again"
