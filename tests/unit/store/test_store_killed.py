"""Killed at any line of restoring, copying, opening, updating or unpacking: it opens again, with all that it had."""

import shutil
import sqlite3
import subprocess
import sys
import zipfile
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.killed_at import is_killed_at
from tests.support.paths import TESTS
from tests.support.store_opener import damaged_folder
from tests.support.store_writer import calibration
from tests.support.tiers import long
from tests.support.waiting import LONG_S
from touchline.core.errors import Unavailable
from touchline.store.archive import restore_into
from touchline.store.opening import FILE, UNFINISHED
from touchline.store.quarantine import roll_back
from touchline.store.store import Store

KILLS = [4, long(75)]  # of each kind of work
MANY = 100_000  # more lines than any of them has
FORMER = TESTS / "golden" / "former_version" / "data.zip"


@pytest.fixture
def tmp_path(memory_path):
    """Many data folders are made and thrown away here."""
    return memory_path


@pytest.fixture
def damaged(tmp_path):
    """A data folder with a good backup, a row that was damaged after it, and a save after that."""
    damaged_folder(tmp_path / "damaged")
    return tmp_path / "damaged"


def notes(store):
    return {one.note for one in store.calibrations.list().items}


def restore(folder):
    with Store(folder) as store:
        return store.restore_backup()


def back_up(folder):
    with Store(folder) as store:
        back_up_now(store)


def back_up_now(store):
    with store._backups.held:
        store._backups.make()


def opened(folder):
    Store(folder).close()


def killed(kills, source, tmp_path, work, *given):
    """Yield a copy of the folder for each of so many lines, evenly spread, at which the work on it was killed."""
    lines = _lines(source, tmp_path / "whole", work, *given)
    for number in range(kills):
        folder = tmp_path / f"killed-{number}"
        _copied(source, folder)
        assert is_killed_at((2 * number + 1) * lines // (2 * kills), work, folder, *given)
        yield folder
        shutil.rmtree(folder)


def _lines(source, folder, work, *given):
    """How many lines the work has, to a tenth."""
    lines, step = 0, MANY
    while step > 10:
        step //= 2
        _copied(source, folder)
        if is_killed_at(lines + step, work, folder, *given):
            lines += step
        shutil.rmtree(folder)
    return lines


def _copied(source, folder):
    if source is not None:
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns(".unfinished*"))


@pytest.mark.parametrize("kills", KILLS)
def test_restoring_that_was_killed_loses_nothing_and_can_be_done_again(damaged, tmp_path, kills):
    for folder in killed(kills, damaged, tmp_path, restore):
        with Store(folder) as store:
            assert notes(store) in ({"newer"}, {"kept"})
            store.restore_backup()
            assert (
                notes(store) == {"kept"}
                and store.calibrations.add(calibration("north", "more")).note == "more"
            )


@pytest.mark.parametrize("kills", KILLS)
def test_a_copy_that_was_killed_leaves_the_database_and_its_copies_as_they_were(
    damaged, tmp_path, kills
):
    before = {
        path.name for path in (damaged / "backups").iterdir() if not path.name.startswith(".")
    }
    for folder in killed(kills, damaged, tmp_path, back_up):
        assert before <= {path.name for path in (folder / "backups").iterdir()}
        back_up(folder)
        with Store(folder) as store:
            assert notes(store) == {"newer"} and [one.kind for one in store.damaged] == [
                "calibrations"
            ]
        assert not [path.name for path in folder.rglob("*.tmp*")]


@pytest.mark.parametrize("kills", KILLS)
def test_an_update_that_was_killed_goes_on(tmp_path, kills):
    former = tmp_path / "former"
    with zipfile.ZipFile(FORMER) as source:
        source.extractall(former)
    with Store(_as(former, tmp_path / "known")) as store:
        known = {one.id for one in store.calibrations.list().items}
    for folder in killed(kills, former, tmp_path, opened):
        with Store(folder) as store:
            assert {
                one.id for one in store.calibrations.list().items
            } == known and store.damaged == ()


@pytest.mark.parametrize("kills", KILLS)
def test_an_archive_whose_unpacking_was_killed_is_never_taken_for_whole(damaged, tmp_path, kills):
    with Store(damaged) as store:
        archive = tmp_path / "all.zip"
        archive.write_bytes(b"".join(store.archive()))
    for folder in killed(kills, None, tmp_path, unpacked, archive):
        try:
            with Store(folder) as store:
                assert not notes(store) or notes(store) == {"newer"}
        except Unavailable as told:
            assert told.reason == "restore-unfinished" and "restore the archive again" in told.fix


def unpacked(folder, archive):
    folder.mkdir(exist_ok=True)
    restore_into(archive, folder, None)


def _as(source, folder):
    shutil.copytree(source, folder)
    return folder


CUT_SHORT = """
import os, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
for step in ("PRAGMA journal_mode=DELETE", "PRAGMA cache_size=1", "BEGIN IMMEDIATE",
             "CREATE TABLE half AS SELECT body, body AS again FROM calibrations",
             "UPDATE ledger SET changes = changes + 100", "INSERT INTO half SELECT again, body FROM half"):
    connection.execute(step)
os._exit(0)
"""


def cut_short(path):
    """A change that a kill has cut short: half of it is in the file, and the journal has what was there before."""
    subprocess.run([sys.executable, "-c", CUT_SHORT, str(path)], check=True, timeout=LONG_S)
    assert path.with_name(f"{path.name}-journal").stat().st_size > 0


def test_a_change_that_was_cut_short_is_undone_and_not_called_damage(damaged):
    cut_short(damaged / FILE)
    with Store(damaged) as store:
        assert notes(store) == {"newer"} and [one.kind for one in store.damaged] == ["calibrations"]
    assert not (damaged / f"{FILE}-journal").exists()


def test_what_an_earlier_restoring_has_left_does_not_disable_the_next(damaged):
    """The journal of another database would be taken for the new one's own."""
    with Store(damaged) as store:
        for path in (damaged / UNFINISHED, damaged / "backups" / ".unfinished.tmp"):
            shutil.copyfile(max((damaged / "backups").glob("0*.db")), path)
            cut_short(path)
            path.unlink()
        back_up_now(store)
        store.restore_backup()
        assert notes(store) == {"kept"}
    left = [path.name for path in damaged.rglob("*-journal")]
    assert left == []


def test_a_journal_goes_to_the_quarantine_with_its_database(damaged):
    journal = Path(f"{damaged / FILE}-journal")
    with closing(sqlite3.connect(damaged / FILE)) as connection:
        connection.execute("PRAGMA journal_mode=DELETE")
    (damaged / FILE).write_bytes(b"no database")
    journal.write_bytes(b"no journal")
    with Store(damaged) as store:
        assert notes(store) in ({"kept"}, {"newer"})
        assert [one.file for one in store.damaged if one.kind == "database"] == [
            f"quarantine/database/{FILE}"
        ]
    assert not journal.exists()


def test_a_journal_without_its_database_makes_none_and_a_log_is_left_to_who_checks_it(
    damaged, tmp_path
):
    roll_back(tmp_path / "none.db")
    (tmp_path / "none.db-journal").write_bytes(b"journal")
    roll_back(tmp_path / "none.db")
    assert not (tmp_path / "none.db").exists()
    path = damaged / FILE
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE ledger SET changes = changes + 1")
        connection.commit()
        shutil.copytree(damaged, tmp_path / "open")
    copy = tmp_path / "open" / FILE
    log = copy.with_name(f"{FILE}-wal")
    before = log.read_bytes()
    copy.with_name(f"{FILE}-journal").write_bytes(b"journal")
    roll_back(copy)
    assert before and log.read_bytes() == before
