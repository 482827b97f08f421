"""Room on the disk: pictures keep to their share, calibrations are always saved, backups are thinned out and whole."""

import os
import sqlite3
import threading
from contextlib import closing
from datetime import UTC, datetime, timedelta

import pytest

from tests.support.store_writer import calibration
from tests.support.waiting import LONG_S, until
from touchline.core.errors import DiskFull, Unavailable
from touchline.core.geometry import ImageSize
from touchline.store.backups import MAX_COPIES, Backups
from touchline.store.files import write_atomically
from touchline.store.integrity import find_damage
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store

SIZE = ImageSize(640, 480)
MB = 1_000_000


def save_clicks(store, id):
    points = [{"feature": "left", "kind": "line", "points": [[1.0, 2.0]]}]
    store.drafts.save(id, {**EMPTY, "observations": points}, store.drafts.get(id).etag)


def from_snapshot(store, id):
    from dataclasses import replace

    return store.calibrations.add(replace(calibration("north", "1"), snapshot=id))


def test_the_oldest_picture_that_nothing_needs_makes_room_and_a_needed_one_never_does(
    opener, tmp_path
):
    with opener(tmp_path / "data", uploads_bytes=10_000) as store:
        fitted, begun, board, loose, looser = (
            store.snapshots.add(os.urandom(1800), SIZE, "png").id for _ in range(5)
        )
        deleted = from_snapshot(store, fitted)
        store.calibrations.delete(deleted.id)  # hidden, and still resting on its picture
        save_clicks(store, begun)
        store.lenses.add({"model": "ssl", "snapshots": [board]})
        # nothing was clicked
        store.drafts.save(loose, {**EMPTY, "field": "f"}, store.drafts.get(loose).etag)
        new = store.snapshots.add(os.urandom(1800), SIZE, "png").id
        assert [s.id for s in store.snapshots.list().items] == [new, looser, board, begun, fitted]
        store.snapshots.add(os.urandom(1800), SIZE, "png")
        assert {fitted, begun, board} < {s.id for s in store.snapshots.list().items}
        with opener.again(store, uploads_bytes=10_000) as again:
            for id in (fitted, begun, board):
                assert len(again.snapshots.picture(id)) == 1800
            assert (
                sum(path.stat().st_size for path in (again.folder / "pictures").iterdir()) <= 10_000
            )


def test_when_every_picture_is_needed_a_new_one_is_refused_and_work_goes_on(opener, tmp_path):
    with opener(tmp_path / "data", uploads_bytes=4000) as store:
        for _ in range(2):
            save_clicks(store, store.snapshots.add(os.urandom(1800), SIZE, "png").id)
        with pytest.raises(DiskFull) as told:
            store.snapshots.add(os.urandom(1800), SIZE, "png")
        assert (told.value.status, told.value.reason) == (507, "uploads-full") and told.value.fix
        assert store.calibrations.add(calibration("north", "1")).version == 1


def test_a_picture_that_two_snapshots_share_goes_with_the_second(opener, tmp_path):
    with opener(tmp_path / "data", uploads_bytes=4000) as store:
        first = store.snapshots.add(b"x" * 1800, SIZE, "png").id
        second = store.snapshots.add(b"x" * 1800, SIZE, "png").id
        save_clicks(store, second)
        store.snapshots.add(b"y" * 1800, SIZE, "png")
        store.snapshots.add(b"z" * 1800, SIZE, "png")
        assert store.snapshots.picture(second) == b"x" * 1800 and first not in [
            s.id for s in store.snapshots.list().items
        ]


def test_a_file_that_a_kill_left_without_its_row_goes_first(opener, tmp_path):
    with opener(tmp_path / "data", uploads_bytes=4000) as store:
        (store.folder / "pictures" / f"{'0' * 64}.png").write_bytes(b"o" * 1800)
        with opener.again(store, uploads_bytes=4000) as again:
            kept = again.snapshots.add(b"x" * 1800, SIZE, "png")
            again.snapshots.add(b"y" * 1800, SIZE, "png")
            assert (
                again.snapshots.picture(kept.id)
                and len(list((again.folder / "pictures").iterdir())) == 2
            )


def test_a_file_that_is_about_to_get_its_row_is_not_one_without(opener, tmp_path, monkeypatch):
    written, go_on = threading.Event(), threading.Event()

    def write(path, data):
        write_atomically(path, data)
        if data == first:
            written.set()
            assert go_on.wait(LONG_S)

    monkeypatch.setattr("touchline.store.snapshots.write_atomically", write)
    first, second = b"x" * 1800, b"y" * 2000
    with opener(tmp_path / "data", uploads_bytes=4000) as store:
        store.snapshots.add(b"o" * 2100, SIZE, "png")  # makes room for the second
        adding = [
            threading.Thread(target=store.snapshots.add, args=(data, SIZE, "png"))
            for data in (first, second)
        ]
        adding[0].start()
        assert written.wait(LONG_S)
        adding[1].start()
        adding[1].join(0.3)  # in which it would have removed the first one's file
        go_on.set()
        for one in adding:
            one.join(LONG_S)
        assert {store.snapshots.picture(s.id) for s in store.snapshots.list().items} == {
            first,
            second,
        }


@pytest.mark.parametrize(
    "free_mb, warned, refused", [(600, False, False), (400, True, False), (50, True, True)]
)
def test_a_nearly_full_disk_is_told_then_refuses_pictures_and_always_takes_calibrations(
    tmp_path, free_mb, warned, refused
):
    with Store(tmp_path, free=lambda folder: free_mb * MB) as store:
        assert [w.reason for w in store.warnings] == (["disk-nearly-full"] if warned else [])
        if refused:
            with pytest.raises(DiskFull) as told:
                store.snapshots.add(b"x", SIZE, "png")
            assert told.value.status == 507
        else:
            store.snapshots.add(b"x", SIZE, "png")
        assert store.calibrations.add(calibration("north", "1")).version == 1


@pytest.fixture
def source(tmp_path):
    """A database with some changes, closed."""
    with Store(tmp_path / "data") as store:
        store.calibrations.add(calibration("north", "1"))
    return tmp_path / "data" / "touchline.db"


def changed(source, count):
    with closing(sqlite3.connect(source)) as connection:
        connection.execute("UPDATE ledger SET changes = ?", (count,))
        connection.commit()


def placed(backups, numbered, size=1):
    """Copies by change and hours since noon, as they would have been made, thinned out after each."""
    noon = datetime(2026, 11, 21, 12, tzinfo=UTC)
    for count, hour in numbered:
        name = backups._folder / f"{count:012d}.{noon + timedelta(hours=hour):%Y-%m-%dT%H}.db"
        name.write_bytes(b"x" * size)
        backups._thin()
    return backups.all()


def test_copies_thin_out_with_age_whatever_the_clock_does(tmp_path, source):
    hours = [k // 3 for k in range(1500)]  # three a hour, for three weeks
    hours[100:110] = [-9000] * 10  # the clock jumps by a year, and back
    kept = placed(Backups(tmp_path / "copies", source), enumerate(hours))
    assert [b.changes for b in kept[:12]] == list(range(1499, 1487, -1))
    assert [hours[b.changes] for b in kept[12:32]] == list(range(495, 475, -1)), (
        "the last one of each hour"
    )
    assert [hours[b.changes] % 24 for b in kept[32:-2]] == [11] * 12, "the last one of each day"
    assert [hours[b.changes] for b in kept[-2:]] == [-9000, 33], "the last one of each week"


def test_few_copies_of_a_large_database_reach_far_back(tmp_path, source, monkeypatch):
    monkeypatch.setattr("touchline.store.backups.SMALL_BYTES", 0)
    hours = [k // 3 for k in range(1500)]
    kept = placed(Backups(tmp_path / "copies", source), enumerate(hours), 100)
    assert len(kept) == MAX_COPIES
    assert [hours[b.changes] for b in kept] == [499, 499, 499, 498, 491, 371], (
        "hours, days and a week ago"
    )


def test_backups_keep_to_their_share_and_the_newest_is_always_there(tmp_path, source):
    size = source.stat().st_size
    backups = Backups(tmp_path / "copies", source, limit_bytes=3 * size + size // 2)
    for count in range(10, 20):
        changed(source, count)
        backups.make()
    assert [b.changes for b in backups.all()] == [19, 18, 17]
    small = Backups(tmp_path / "copies", source, limit_bytes=1)
    changed(source, 20)
    small.make()
    assert [b.changes for b in small.all()] == [20]


def test_a_backup_made_while_others_save_is_whole_and_restores_to_a_state_that_was(tmp_path):
    with Store(tmp_path / "data") as store:
        for k in range(60):
            store.calibrations.add(calibration("north", str(k)))
        until(
            lambda: store.calibrations.add(calibration("north", "more")) and store._backups.all(),
            lambda copies: len(copies) >= 3,
        )
    copies = Backups(tmp_path / "data" / "backups", tmp_path / "data" / "touchline.db").all()
    assert len(copies) >= 3 and all(find_damage(copy.path) is None for copy in copies)
    for copy in copies:
        with closing(sqlite3.connect(copy.path)) as connection:
            versions = [
                row[0]
                for row in connection.execute("SELECT version FROM calibrations ORDER BY sequence")
            ]
        # each change was a save: a state between two of them
        assert versions == list(range(1, copy.changes + 1))


def test_a_backup_that_cannot_be_made_is_told_and_saving_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("touchline.store.backups.free_bytes", lambda folder: 0)
    with Store(tmp_path) as store:
        assert store.calibrations.add(calibration("north", "1")).version == 1
        until(lambda: store.warnings)
        assert [w.reason for w in store.warnings] == ["no-backup"]


def test_postgresql_that_goes_away_is_told_and_work_goes_on_when_it_is_back(postgres, tmp_path):
    with Store(tmp_path / "data", database=postgres.database(tmp_path / "data")) as store:
        kept = store.calibrations.add(calibration("north", "1"))
        postgres.stop()
        for call in (
            lambda: store.calibrations.add(calibration("north", "2")),
            lambda: store.calibrations.get(kept.id),
        ):
            with pytest.raises(Unavailable) as told:
                call()
            assert told.value.reason == "database-away" and told.value.status == 503
        postgres.start()
        assert (
            store.calibrations.get(kept.id) == kept
            and store.calibrations.add(calibration("north", "2")).version == 2
        )
