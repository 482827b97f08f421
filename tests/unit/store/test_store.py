"""The store: what was saved is read back, nobody overwrites anybody, and a damaged file is told and never missing."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import update

from tests.support.store_opener import count_rows, damage_row
from tests.support.tiers import long
from touchline.core.errors import BadInput, Conflict, NotFound, Stale, Unavailable
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration
from touchline.store.quarantine import DamagedFile
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store
from touchline.store.tables import ActiveRow, CalibrationRow, DraftRow, SnapshotRow

SIZE = ImageSize(640, 480)
DRAFT = {
    **EMPTY,
    "field": "ssl-2008",
    "region": "half-left",
    "observations": [{"feature": "left", "kind": "line", "points": [[1.25, 0.1 + 0.2]]}],
}


def calibration(camera=None, note=""):
    """A small but whole calibration, before it is kept."""
    return Calibration(
        id="",
        version=0,
        camera=camera,
        field={"name": "f"},
        region="full",
        rotate=0,
        model_name="m",
        model_parameters={"k": 1 / 3},
        image_size=SIZE,
        corrected_size=SIZE,
        observations=(),
        options={},
        report={"rms_px": None},
        created_at="",
        software="0",
        note=note,
    )


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        yield store


def now_and_after_a_restart(opener, store):
    yield store
    yield opener.again(store)


def test_a_snapshot_keeps_its_bytes_and_what_they_are(opener, store):
    kept = store.snapshots.add(b"bytes", SIZE, "jpeg", camera="north")
    with opener.again(store) as again:
        assert again.snapshots.get(kept.id) == kept and again.snapshots.picture(kept.id) == b"bytes"
    assert (kept.size, kept.format, kept.camera) == (SIZE, "jpeg", "north")
    assert kept.sha256 == sha256(b"bytes").hexdigest() and kept.format == "jpeg"


def test_snapshots_are_listed_by_what_they_were_taken_for_also_after_a_restart(opener, store):
    purposes = ["picture", "board", "board", "straight", "picture"]
    kept = [
        store.snapshots.add(b"%d" % k, SIZE, "png", purpose=purpose)
        for k, purpose in enumerate(purposes)
    ]

    def ids(look, **asked):
        page = look.snapshots.list(**asked)
        following = ids(look, **{**asked, "cursor": page.next_cursor}) if page.next_cursor else []
        return [s.id for s in page.items] + following

    for look in now_and_after_a_restart(opener, store):
        for purpose in ("picture", "board", "straight"):
            wanted = [s.id for s in kept[::-1] if s.purpose == purpose]
            assert ids(look, purpose=purpose) == wanted == ids(look, purpose=purpose, limit=1)
        assert ids(look) == [s.id for s in kept[::-1]]
    look.close()


def test_snapshots_are_listed_by_their_camera(store):
    cameras = ["north", "NORTH", "nor_h", 'n"h', "é", None, "north"]
    kept = [store.snapshots.add(b"%d" % k, SIZE, "png", camera) for k, camera in enumerate(cameras)]
    for camera in cameras[:5]:
        assert store.snapshots.list(camera=camera).items == tuple(
            s for s in kept[::-1] if s.camera == camera
        )
    assert [s.id for s in store.snapshots.list(camera="north", limit=1).items] == [kept[-1].id]
    assert store.snapshots.list(camera="orth").items == ()


def test_the_same_picture_twice_is_two_snapshots_and_one_file(store):
    first, second = (store.snapshots.add(b"same", SIZE, "png") for _ in range(2))
    assert first.id != second.id
    assert len(list((store.folder / "pictures").iterdir())) == 1


def test_a_draft_begins_empty_and_is_saved_over_what_was_read(opener, store):
    id = store.snapshots.add(b"x", SIZE, "png").id
    empty = store.drafts.get(id)
    assert empty.body == EMPTY and empty.updated_at is None
    saved = store.drafts.save(id, DRAFT, empty.etag)
    assert saved.body == DRAFT and saved.etag != empty.etag and saved.updated_at
    with opener.again(store) as again:
        assert again.drafts.get(id) == saved


def test_a_stale_draft_is_refused_with_the_current_one(store):
    id = store.snapshots.add(b"x", SIZE, "png").id
    opened = store.drafts.get(id).etag
    theirs = store.drafts.save(id, DRAFT, opened)
    with pytest.raises(Stale) as refusal:
        store.drafts.save(id, EMPTY, opened)
    assert refusal.value.details == {"current": theirs.to_json(), "etag": theirs.etag}
    assert store.drafts.get(id) == theirs


def test_saving_the_same_words_again_still_gives_a_new_etag(store):
    id = store.snapshots.add(b"x", SIZE, "png").id
    etags = [store.drafts.get(id).etag]
    for body in (DRAFT, DRAFT, EMPTY, DRAFT):
        etags.append(store.drafts.save(id, body, etags[-1]).etag)
    assert len(set(etags)) == len(etags)


def test_of_many_who_save_over_the_same_draft_exactly_one_succeeds(store):
    id = store.snapshots.add(b"x", SIZE, "png").id

    def save(etag, who):
        try:
            return store.drafts.save(id, {**DRAFT, "region": f"{who}"}, etag).body["region"]
        except Stale:
            return None

    with ThreadPoolExecutor(16) as threads:
        for _ in range(20):
            etag = store.drafts.get(id).etag
            winners = [
                who
                for who in threads.map(lambda who, e=etag: save(e, who), range(16))
                if who is not None
            ]
            assert len(winners) == 1 and store.drafts.get(id).body["region"] == winners[0]


def test_a_calibration_comes_back_exactly_with_its_id_version_and_date(opener, tmp_path):
    noon = datetime(2026, 11, 21, 12, tzinfo=UTC)
    with opener(tmp_path, clock=lambda: noon) as store:
        kept = store.calibrations.add(calibration(note="after the lens was knocked"))
    assert (kept.version, kept.created_at) == (1, "2026-11-21T12:00:00.000Z") and len(kept.id) == 16
    with opener(tmp_path) as store:
        assert store.calibrations.get(kept.id) == kept
        assert store.calibrations.get(kept.id).model_parameters["k"] == 1 / 3


def test_versions_are_counted_for_each_camera_and_no_camera_is_one(store):
    cameras = ["north", None, "north", "south", None, ""]
    assert [store.calibrations.add(calibration(camera)).version for camera in cameras] == [
        1,
        1,
        2,
        1,
        2,
        1,
    ]


def test_the_number_of_a_deleted_version_is_not_used_again(opener, store):
    first = store.calibrations.add(calibration("north"))
    store.calibrations.delete(first.id)
    with opener.again(store) as again:
        assert again.calibrations.add(calibration("north")).version == 2
        with pytest.raises(NotFound):
            again.calibrations.get(first.id)
        with pytest.raises(NotFound):
            again.calibrations.delete(first.id)


def test_order_is_that_of_saving_even_when_the_clock_jumps_back(opener, tmp_path):
    days = iter([5, 1, 9, 0])
    with opener(
        tmp_path, clock=lambda: datetime(2026, 1, 1, tzinfo=UTC) + timedelta(days=next(days))
    ) as store:
        ids = [store.calibrations.add(calibration()).id for _ in range(4)]
        assert [c.id for c in store.calibrations.list().items] == ids[::-1]


def test_pages_show_everything_once_while_others_come_and_go(store):
    ids = [store.calibrations.add(calibration("north", note=str(k))).id for k in range(7)]
    store.calibrations.add(calibration("south"))
    first = store.calibrations.list("north", limit=3)
    store.calibrations.delete(ids[3])
    store.calibrations.add(calibration("north"))
    second = store.calibrations.list("north", limit=3, cursor=first.next_cursor)
    assert [c.id for c in (*first.items, *second.items)] == [ids[k] for k in (6, 5, 4, 2, 1, 0)]
    assert second.next_cursor is None
    assert len(store.calibrations.list(limit=200).items) == 8
    assert store.calibrations.list("nobody").items == ()


def test_versions_as_text_are_the_same_versions(opener, store):
    note = '",active":true,"field_definition":'
    kept = [store.calibrations.add(calibration(camera, note)) for camera in ("north", None, "ü")]
    store.calibrations.activate(kept[1].id)
    for asked in ({}, {"camera": "north"}, {"limit": 1}, {"limit": 1, "cursor": "2"}):
        as_text, as_records = store.calibrations.found(**asked), store.calibrations.list(**asked)
        assert [json.loads(one.text) for one in as_text.items] == [
            one.to_json() for one in as_records.items
        ]
        assert as_text.next_cursor == as_records.next_cursor


def test_a_version_is_parsed_once_and_checked_at_every_read(store, monkeypatch):
    kept = store.calibrations.add(calibration("north", "1"))
    store.calibrations.activate(kept.id)
    before = store.calibrations.get(kept.id)
    with monkeypatch.context() as patched:
        patched.setattr(Calibration, "from_json", None)
        assert store.calibrations.get(kept.id) == store.calibrations.active("north") == before
        assert store.calibrations.list().items == (before,) and before.active
    assert (
        store.calibrations.annotate(kept.id, "2").note
        == store.calibrations.get(kept.id).note
        == "2"
    )
    damage_row(store, CalibrationRow, lambda text: text.replace('"2"', '"3"'), id=kept.id)
    assert store.calibrations.active("north") is None and store.calibrations.list().items == ()
    with pytest.raises(DamagedFile):
        store.calibrations.get(kept.id)


def test_the_active_versions_of_many_cameras_are_one_read(store, monkeypatch):
    made = {
        camera: [store.calibrations.add(calibration(camera)) for _ in range(2)]
        for camera in ("a", "ü", "c", None)
    }
    for camera in ("a", "ü", None):
        store.calibrations.activate(made[camera][0].id)
    reads, reading = [], store._database.reading
    monkeypatch.setattr(store._database, "reading", lambda: reads.append(1) or reading())
    found = store.calibrations.active_of(["ü", "nobody", None, "c", "a"])
    assert list(found.items()) == [
        (camera, made[camera][0].activated(True)) for camera in ("ü", None, "a")
    ]
    assert len(reads) == 1
    assert store.calibrations.active_of([]) == {}


def test_a_page_that_ends_with_the_last_one_has_no_next(store):
    for k in range(4):
        store.snapshots.add(b"%d" % k, SIZE, "png")
    assert store.snapshots.list(limit=4).next_cursor is None
    assert [
        len(store.snapshots.list(limit=2, cursor=store.snapshots.list(limit=2).next_cursor).items)
    ] == [2]


@pytest.mark.parametrize("cursor", ["", "-1", "x", "1e3", "9" * 13, "../1", "١"])
def test_a_cursor_that_is_not_ours_is_refused(store, cursor):
    with pytest.raises(BadInput) as refusal:
        store.snapshots.list(cursor=cursor)
    assert refusal.value.reason == "bad-cursor"


def test_each_camera_has_one_active_version_and_rolling_back_is_activating_it(opener, store):
    old, new, other, nobodys = (
        store.calibrations.add(calibration(camera)) for camera in ("north", "north", "south", None)
    )
    assert store.calibrations.active("north") is None
    for one in (old, other, nobodys, new):
        assert store.calibrations.activate(one.id).active
    assert store.calibrations.active("north") == replace(new, active=True)
    store.calibrations.activate(old.id)
    with opener.again(store) as again:
        assert [again.calibrations.active(camera).id for camera in ("north", "south", None)] == [
            old.id,
            other.id,
            nobodys.id,
        ]
        assert {c.id for c in again.calibrations.list().items if c.active} == {
            old.id,
            other.id,
            nobodys.id,
        }


def test_activations_of_all_cameras_are_told_also_of_versions_that_are_gone(opener, store):
    north, south, files, newer = (
        store.calibrations.add(calibration(camera)) for camera in ("north", "south", None, "north")
    )
    for one in (north, south, files, newer):
        store.calibrations.activate(one.id, "Ada")
    store.calibrations.delete(north.id)
    told = [("north", 2), (None, 1), ("south", 1), ("north", 1)]
    for look in now_and_after_a_restart(opener, store):
        found = look.calibrations.activations()
        assert [(one["camera"], one["version"]) for one in found] == told and {
            one["by"] for one in found
        } == {"Ada"}
        assert look.calibrations.activations(limit=2) == found[:2]
    look.close()
    with opener.again(store) as again:
        damage_row(again, CalibrationRow, DAMAGE["one bit"], id=south.id)
        assert [
            (one["camera"], one["version"]) for one in again.calibrations.activations()
        ] == told[:2] + told[3:]


def test_the_active_version_cannot_be_deleted(store):
    first, second = (
        store.calibrations.add(calibration("north")),
        store.calibrations.add(calibration("north")),
    )
    store.calibrations.activate(first.id)
    with pytest.raises(Conflict) as refusal:
        store.calibrations.delete(first.id)
    assert refusal.value.reason == "calibration-active"
    store.calibrations.activate(second.id)
    store.calibrations.delete(first.id)
    assert [c.id for c in store.calibrations.list().items] == [second.id]


@pytest.mark.parametrize(
    "id", ["", "0" * 16, "../lock", "..", "/etc/hostname", "a\0b", "x" * 5000, "%2e%2e"]
)
def test_an_id_that_nobody_gave_out_names_nothing(store, id):
    for call in (
        store.snapshots.get,
        store.snapshots.picture,
        store.drafts.get,
        store.calibrations.get,
        store.calibrations.activate,
        store.calibrations.delete,
        lambda id: store.drafts.save(id, DRAFT, ""),
    ):
        with pytest.raises(NotFound):
            call(id)
    assert not any(count_rows(store).values()) and not list((store.folder / "pictures").iterdir())


def test_a_number_that_is_not_finite_is_refused_and_nothing_is_kept(store):
    id = store.snapshots.add(b"x", SIZE, "png").id
    for call in (
        lambda: store.drafts.save(
            id, {**DRAFT, "options": {"a": float("nan")}}, store.drafts.get(id).etag
        ),
        lambda: store.calibrations.add(replace(calibration(), report={"rms_px": float("inf")})),
    ):
        with pytest.raises(BadInput) as refusal:
            call()
        assert refusal.value.reason == "non-finite-number"
    assert store.drafts.get(id).body == EMPTY and store.calibrations.list().items == ()


DAMAGE = {
    "emptied": lambda text: "",
    "cut": lambda text: text[:-7],
    "zeros": lambda text: "0" * len(text),
    "one bit": lambda text: text[:40] + chr(ord(text[40]) ^ 1) + text[41:],
    "longer": lambda text: text + " ",
    "of another kind": lambda text: '{"id": "somebody else"}',
}


@pytest.mark.parametrize("how", DAMAGE)
def test_a_damaged_calibration_is_moved_aside_and_told_every_time(opener, store, how):
    kept, other = (
        store.calibrations.add(calibration("north")),
        store.calibrations.add(calibration("north")),
    )
    store.calibrations.activate(kept.id)
    damage_row(store, CalibrationRow, DAMAGE[how], id=kept.id)
    for look in now_and_after_a_restart(opener, store):
        assert look.calibrations.active("north") is None, "it stops no list and no start"
        for call in (look.calibrations.get, look.calibrations.activate):
            with pytest.raises(DamagedFile) as told:
                call(kept.id)
            assert told.value.status == 503 and kept.id in told.value.what and told.value.fix
        assert [c.id for c in look.calibrations.list(limit=1).items] == [other.id]
        assert [d.kind for d in look.damaged] == ["calibrations"]
        assert (look.folder / look.damaged[0].to_json()["file"]).is_file()
    assert look.calibrations.add(calibration("north")).version == 3
    assert look.calibrations.activate(other.id) == look.calibrations.active("north")
    look.close()


@pytest.mark.parametrize("how", DAMAGE)
def test_a_damaged_draft_leaves_a_notice_until_the_next_save(opener, store, how):
    id = store.snapshots.add(b"x", SIZE, "png").id
    before = store.drafts.save(id, DRAFT, store.drafts.get(id).etag)
    damage_row(store, DraftRow, DAMAGE[how], snapshot=id)
    with opener.again(store) as again:
        lost = again.drafts.get(id)
        assert lost.body == EMPTY and "damaged" in lost.notice and "notice" in lost.to_json()
        with pytest.raises(Stale):
            again.drafts.save(id, DRAFT, before.etag)
        assert again.drafts.save(id, DRAFT, lost.etag).notice is None
        assert again.drafts.get(id).notice is None and len(again.damaged) == 1


@pytest.mark.parametrize("kind", ["snapshots", "pictures"])
def test_a_damaged_snapshot_is_told_and_the_same_picture_can_be_kept_anew(opener, store, kind):
    kept, other = (
        store.snapshots.add(b"x" * 200, SIZE, "png"),
        store.snapshots.add(b"y", SIZE, "png"),
    )
    if kind == "snapshots":
        damage_row(store, SnapshotRow, DAMAGE["one bit"], id=kept.id)
    else:
        damage_file(store.folder / kind / f"{kept.sha256}.png")
    for look in now_and_after_a_restart(opener, store):
        with pytest.raises(DamagedFile):
            look.snapshots.picture(kept.id)
        assert look.snapshots.picture(other.id) == b"y" and [d.kind for d in look.damaged] == [kind]
    assert other in look.snapshots.list().items
    again = look.snapshots.add(b"x" * 200, SIZE, "png")
    assert look.snapshots.picture(again.id) == b"x" * 200
    look.close()


def test_a_damaged_picture_that_nobody_has_noticed_is_made_whole_by_its_next_upload(store):
    kept = store.snapshots.add(b"x" * 200, SIZE, "png")
    damage_file(store.folder / "pictures" / f"{kept.sha256}.png")
    store.snapshots.add(b"x" * 200, SIZE, "png")
    assert store.snapshots.picture(kept.id) == b"x" * 200


def test_a_damaged_list_of_active_versions_is_told_and_no_version_is_lost(opener, store):
    kept = store.calibrations.add(calibration("north"))
    store.calibrations.activate(kept.id)
    with store._database.engine.begin() as connection:
        connection.execute(update(ActiveRow).values(sha256="0" * 64))
    with opener.again(store) as again:
        assert (
            again.calibrations.active("north") is None and again.calibrations.get(kept.id) == kept
        )
        assert [d.kind for d in again.damaged] == ["active"]


def damage_file(path):
    data = path.read_bytes()
    path.write_bytes(data[:90] + bytes([data[90] ^ 1]) + data[91:])


def test_a_second_process_is_kept_out_and_told_who_is_in(opener, store):
    code = (
        "import sys; from pathlib import Path; from touchline.store.store import Store\n"
        "try: Store(Path(sys.argv[1]))\nexcept Exception as e: print(e.reason, e)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, str(store.folder)], capture_output=True, text=True
    ).stdout
    assert told.startswith("data-folder-in-use") and str(os.getpid()) in told
    with pytest.raises(Unavailable):
        Store(store.folder)
    opener.again(store).close()


def test_a_data_folder_that_cannot_be_used_is_said_plainly(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(Unavailable) as told:
        Store(tmp_path / "file")
    assert told.value.reason == "data-folder"


@pytest.mark.parametrize("examples", [15, long(100)])
def test_any_text_and_any_finite_number_come_back_exactly(store, examples):
    @settings(max_examples=examples, derandomize=True, deadline=None)
    @given(
        text=st.text(st.characters(), max_size=40),
        number=st.floats(allow_nan=False, allow_infinity=False),
    )
    def comes_back(text, number):
        made = replace(
            calibration(text, note=text), options={text: number}, snapshot=text, parent=text
        )
        kept = store.calibrations.add(made, by=text)
        assert store.calibrations.get(kept.id) == kept
        id = store.snapshots.add(text.encode("utf-8", "replace"), SIZE, "png", camera=text).id
        assert store.snapshots.get(id).camera == text
        assert store.drafts.save(
            id, {**DRAFT, "options": {text: number}}, store.drafts.get(id).etag
        ) == store.drafts.get(id)

    comes_back()
