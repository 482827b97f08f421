"""Opening a database that somebody or something has damaged: sound, restored and told, or refused; never empty."""

import json
import os
import random
import shutil
import sqlite3
from contextlib import closing

import pytest
from sqlalchemy import update

from tests.support.store_opener import damage_row
from tests.support.store_writer import calibration
from tests.support.tiers import long
from touchline.core.errors import NotFound, TouchlineError, Unavailable
from touchline.core.geometry import ImageSize
from touchline.store.quarantine import DamagedFile
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store
from touchline.store.tables import CalibrationRow, LensRow

SIZE = ImageSize(640, 480)
PAGE = 4096
FILE = "touchline.db"
# images of a torn log; the figure is of many more
MAX_TORN = int(os.environ.get("TOUCHLINE_TORN", "16"))


@pytest.fixture
def tmp_path(memory_path):
    """Hundreds of data folders are made and thrown away here: in memory, where there is a disk of that kind."""
    return memory_path


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    """A closed data folder with a backup, and saves since then: (folder, what is in it)."""
    folder = tmp_path_factory.mktemp("full") / "data"
    with Store(folder) as store:
        fill(store, 12)
    with Store(folder) as store:
        fill(store, 5)
        known = look(store)
        # the state without a tidy end: a log beside it
        with closing(sqlite3.connect(folder / FILE)) as source:
            source.execute("SELECT 1 FROM ledger").fetchone()
            copy = folder.parent / "copy"
            # a backup under way
            shutil.copytree(folder, copy, ignore=shutil.ignore_patterns(".unfinished*"))
    return copy, known


def fill(store, count):
    snapshot = store.snapshots.add(os.urandom(500), SIZE, "png").id
    store.drafts.save(snapshot, {**EMPTY, "field": "f"}, store.drafts.get(snapshot).etag)
    for k in range(count):
        kept = store.calibrations.add(calibration(("north", "south", None)[k % 3], f"note {k}"))
    store.calibrations.activate(kept.id)
    store.lenses.add({"model": "ssl"})


def look(store):
    """Everything that is in a store, by what it is."""
    found = {("calibration", c.id): c for c in store.calibrations.list(limit=200).items}
    found |= {("snapshot", s.id): s for s in store.snapshots.list(limit=200).items}
    found |= {
        ("draft", s.id): store.drafts.get(s.id).body for s in store.snapshots.list(limit=200).items
    }
    found |= {("lens", lens["id"]): lens for lens in store.lenses.list(limit=200).items}
    return found | {
        ("active", camera): store.calibrations.active(camera).id
        for camera in ("north", "south", None)
        if store.calibrations.active(camera)
    }


def mutations(data, log, chance):
    """(name, how the database's file and its log are afterwards); None: the file is gone."""
    pages = len(data) // PAGE

    def put(place, bytes_):
        return data[:place] + bytes_ + data[place + len(bytes_) :]

    for page in chance.sample(range(pages), min(pages, 14)):
        yield f"zeros in page {page}", put(page * PAGE, bytes(PAGE)), log
        yield f"garbage in page {page}", put(page * PAGE, chance.randbytes(PAGE)), log
        yield f"cut at page {page}", data[: page * PAGE], log
        place = chance.randrange(page * PAGE, page * PAGE + PAGE)
        yield (
            f"a bit of byte {place}",
            put(place, bytes([data[place] ^ 1 << chance.randrange(8)])),
            log,
        )
        yield f"a bit of byte {place}, no log", put(place, bytes([data[place] ^ 4])), None
    for place in (0, 16, 18, 20, 24, 28, 36, 40, 44, 52, 56, 60, 96):
        yield f"header byte {place}", put(place, bytes([data[place] ^ 0x55])), log
    yield "empty", b"", None
    yield "empty, with its log", b"", log
    yield "gone", None, None
    yield "gone, with its log", None, log
    yield "text", b"this was a database once\n" * 500, None
    yield "the log is gone", data, None
    yield "the log is garbage", data, chance.randbytes(len(log))
    yield "the log is cut", data, log[: len(log) // 3]
    yield "the log is the database", data, data
    for _ in range(15):
        place = chance.randrange(len(log))
        yield (
            f"a bit of the log's byte {place}",
            data,
            log[:place] + bytes([log[place] ^ 8]) + log[place + 1 :],
        )


def damages(full, seed=2026):
    """Those of the full folder: (name, the database's file and its log afterwards)."""
    source, _ = full
    data, log = (source / FILE).read_bytes(), (source / f"{FILE}-wal").read_bytes()
    return mutations(data, log, random.Random(seed))


def damaged(full, folder, changed, changed_log):
    """A copy of the full folder with such files in place of its own."""
    shutil.copytree(full[0], folder)
    for more in ("", "-wal", "-shm"):
        (folder / f"{FILE}{more}").unlink(missing_ok=True)
    if changed is not None:
        (folder / FILE).write_bytes(changed)
    if changed_log is not None:
        (folder / f"{FILE}-wal").write_bytes(changed_log)
    return folder


def damaged_copies(full, tmp_path, seed=2026):
    for number, (name, *changed) in enumerate(damages(full, seed)):
        folder = damaged(full, tmp_path / str(number), *changed)
        yield name, folder
        shutil.rmtree(folder)


def outcome(folder, known, unlogged):
    """ "sound", "restored" or "refused"; an AssertionError where something is missing and nobody is told."""
    try:
        with Store(folder) as store:
            found, damaged = look(store), store.damaged
    except TouchlineError as told:
        assert told.fix and told.reason in (
            "database-damaged",
            "database-missing",
            "damaged-file",
            "newer-database",
            "data-folder",
            "database-away",
            "not-saved",
        ), told
        return "refused"
    for key in found.keys() & known.keys():
        # never another content under the same id, whatever became of the active one
        if key[0] == "calibration":
            assert found[key].activated(False) == known[key].activated(False)
    assert found, "an empty store in place of a full one"
    if not damaged:
        assert unlogged or found.keys() == known.keys(), "something is missing, and nobody is told"
        return "sound"
    return "restored"


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        # as the log has the page again, or the newest backup more than the log
        *(
            (kind, "sound restored")
            for kind in (
                "zeros in page",
                "garbage in page",
                "a bit of byte",
                "header byte",
                "the log is gone",
                "the log is garbage",
                "the log is the database",
                "the log is cut",
                "a bit of the log's byte",
            )
        ),
        ("cut at page", "restored"),
        ("empty", "restored"),
        ("gone", "restored"),
        ("text", "restored"),
    ],
)
def test_a_damaged_database_is_restored_or_refused_and_never_silently_empty(
    full, tmp_path, kind, wanted
):
    """The first damage of each kind; what only a log that is lost held leaves no trace but in the backups."""
    name, *changed = next(one for one in damages(full) if one[0].startswith(kind))
    assert (
        outcome(damaged(full, tmp_path / "data", *changed), full[1], unlogged="log" in name)
        in wanted
    )


@pytest.mark.long
def test_over_a_hundred_damaged_databases_are_restored_or_refused_and_never_silently_empty(
    full, tmp_path
):
    outcomes = {}
    for name, folder in damaged_copies(full, tmp_path):
        outcomes[name] = outcome(folder, full[1], unlogged="log" in name)
    counts = {
        kind: list(outcomes.values()).count(kind) for kind in ("sound", "restored", "refused")
    }
    print(f"{len(outcomes)} damaged databases with backups: {counts}")
    assert len(outcomes) >= 100 and counts["restored"] >= 40


def refused_as_it_is(full, folder):
    """Whether the damaged folder, without its backups, is refused; then its database is the same afterwards."""
    shutil.rmtree(folder / "backups")
    before = (folder / FILE).read_bytes() if (folder / FILE).exists() else None
    if outcome(folder, full[1], unlogged=False) != "refused":
        return False
    assert before is None or (folder / FILE).read_bytes() == before
    return True


@pytest.mark.parametrize("kind", ["cut at page", "empty", "gone", "text"])
def test_without_a_backup_a_damaged_database_is_refused_and_left_as_it_is(full, tmp_path, kind):
    _, *changed = next(one for one in damages(full) if one[0].startswith(kind))
    assert refused_as_it_is(full, damaged(full, tmp_path / "data", *changed))


@pytest.mark.long
def test_of_many_damaged_databases_without_a_backup_most_are_refused(full, tmp_path):
    refused = [
        refused_as_it_is(full, folder)
        for name, folder in damaged_copies(full, tmp_path, 7)
        if name.startswith(("zeros", "cut", "header", "empty", "gone", "text"))
    ]
    print(f"{len(refused)} damaged databases without a backup: {sum(refused)} refused")
    assert sum(refused) >= 20


def test_the_restored_backup_is_named_and_what_is_newer_is_only_in_the_quarantine(tmp_path):
    folder = tmp_path / "data"
    with Store(folder) as store:
        fill(store, 3)
        known = look(store)
    before = set((folder / "backups").iterdir())
    with Store(folder) as store:
        fill(store, 2)
    for backup in set((folder / "backups").iterdir()) - before:
        backup.unlink()
    with closing(sqlite3.connect(folder / FILE)) as source:
        query = "SELECT rootpage FROM sqlite_master WHERE name = 'ix_calibrations_camera'"
        (page,) = source.execute(query).fetchone()
    data = bytearray((folder / FILE).read_bytes())
    # an index: the check fails, and every row can still be read
    data[(page - 1) * PAGE : page * PAGE] = bytes(PAGE)
    (folder / FILE).write_bytes(data)
    with Store(folder) as store:
        (damage,) = store.damaged
        assert (
            damage.kind == "database"
            and "was restored" in damage.note
            and "only in this file" in damage.note
        )
        assert (folder / damage.file).read_bytes() == data
        assert look(store) == known


def test_a_database_that_is_older_than_its_newest_backup_has_lost_something_and_is_restored(
    tmp_path,
):
    with Store(tmp_path) as store:
        store.calibrations.add(calibration("north", "1"))
    older = (tmp_path / FILE).read_bytes()
    with Store(tmp_path) as store:
        kept = [store.calibrations.add(calibration("north", "2")).id for _ in range(3)]
    (tmp_path / FILE).write_bytes(older)
    with Store(tmp_path) as store:
        assert [one.id for one in store.calibrations.list(limit=3).items] == kept[::-1]
        (damage,) = store.damaged
        assert damage.kind == "database" and "older than its newest backup" in damage.note


def test_a_damaged_row_is_told_with_what_to_do_and_nothing_takes_its_place_unasked(
    tmp_path, caplog
):
    with Store(tmp_path) as store:
        kept, other = (
            store.calibrations.add(calibration("north", "1")),
            store.calibrations.add(calibration("north", "2")),
        )
    with Store(tmp_path) as store:
        damage_row(store, CalibrationRow, lambda text: text.replace("1", "7"), id=kept.id)
    with Store(tmp_path) as store:
        (damage,) = store.damaged
        assert damage.kind == "calibrations" and damage.note is None and damage.restorable
        assert "newest good backup" in damage.fix and damage.fix in caplog.text
        assert json.loads((tmp_path / damage.file).read_bytes())["note"] == "7"
        assert store.calibrations.list().items == (other,)
        with pytest.raises(DamagedFile) as told:
            store.calibrations.get(kept.id)
        assert told.value.fix == damage.fix


@pytest.mark.parametrize(
    "change", [{"deleted_at": "2026"}, {"camera_key": "0" * 12}, {"snapshot": "x"}, {"version": 9}]
)
def test_a_column_that_hides_a_row_is_damage_as_well(opener, tmp_path, change):
    with opener(tmp_path / "data") as store:
        kept = store.calibrations.add(calibration("north", "1"))
    with opener(tmp_path / "data") as store:
        with store._database.engine.begin() as connection:
            connection.execute(
                update(CalibrationRow).where(CalibrationRow.id == kept.id).values(change)
            )
        with opener.again(store) as again:
            assert [d.kind for d in again.damaged] == ["calibrations"]
            if "deleted_at" not in change:
                with pytest.raises(DamagedFile):
                    again.calibrations.get(kept.id)


def test_a_damaged_row_without_a_whole_copy_goes_to_the_quarantine_and_is_named(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        lens = store.lenses.add({"model": "ssl"})
        damage_row(store, LensRow, lambda text: text.replace("ssl", "sss"), id=lens["id"])
        store.close()
        shutil.rmtree(tmp_path / "data" / "backups", ignore_errors=True)
        with opener(tmp_path / "data") as again:
            assert [d.kind for d in again.damaged] == ["lenses"]
            with pytest.raises(DamagedFile):
                again.lenses.get(lens["id"])


def test_a_database_of_a_newer_touchline_is_refused(opener, tmp_path):
    with opener(tmp_path / "data") as store, store._database.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0999'")
    with pytest.raises(Unavailable) as told:
        opener(tmp_path / "data")
    assert told.value.reason == "newer-database" and "0999" in told.value.what


def test_pictures_without_their_database_are_not_silently_begun_anew(opener, tmp_path):
    (tmp_path / "data" / "pictures").mkdir(parents=True)
    (tmp_path / "data" / "pictures" / f"{'a' * 64}.png").write_bytes(b"x")
    with pytest.raises(Unavailable) as told:
        opener(tmp_path / "data")
    assert told.value.reason == "database-missing" and told.value.fix


def test_a_kill_while_a_new_database_is_made_leaves_none_and_the_next_start_makes_it(
    tmp_path, monkeypatch
):
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):

        def killed(engine):
            (tmp_path / f"{FILE}.unfinished").write_bytes(b"half")
            raise KeyboardInterrupt

        patch.setattr("touchline.store.opening.upgrade", killed)
        Store(tmp_path)
    assert not (tmp_path / FILE).exists()
    with Store(tmp_path) as store, pytest.raises(NotFound):
        store.calibrations.get("0" * 16)


@pytest.mark.parametrize("images", [4, long(MAX_TORN)])
def test_no_image_of_a_torn_log_loses_what_was_acknowledged_before(full, tmp_path, images):
    """The last commit's log cut at any sector, or half of its sectors zeroed or garbled: all before it is there."""
    folder = tmp_path / "data"
    with Store(folder) as store:
        fill(store, 6)
        before = look(store)
        at = (folder / f"{FILE}-wal").stat().st_size
        last = store.calibrations.add(calibration("north", "the last"))
        data, log = (folder / FILE).read_bytes(), (folder / f"{FILE}-wal").read_bytes()
    chance = random.Random(1)
    cuts = list(range(at, len(log), 512))
    torn = [log[:cut] for cut in sorted(chance.sample(cuts, min(images, len(cuts))))]
    for _ in range(images // 2):
        image = bytearray(log)
        for sector in range(at, len(log), 512):
            if chance.random() < 0.5:
                image[sector : sector + 512] = chance.choice([bytes(512), chance.randbytes(512)])[
                    : len(log) - sector
                ]
        torn.append(bytes(image))
    for number, image in enumerate(torn):
        place = tmp_path / f"torn{number}"
        place.mkdir()
        shutil.copytree(folder / "pictures", place / "pictures")
        (place / FILE).write_bytes(data)
        (place / f"{FILE}-wal").write_bytes(image)
        with Store(place) as store:
            found = look(store)
            assert store.damaged == ()
        assert {key: value for key, value in found.items() if key[1] != last.id} == before
        shutil.rmtree(place)
    print(f"{len(torn)} torn logs: 0 lost, 0 damaged")
    assert len(torn) > images
