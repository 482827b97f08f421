"""Everything as one zip, and a data folder made of it, on either database; nothing is ever restored over something."""

import json
import zipfile

import pytest

from tests.support.store_opener import StoreOpener, count_rows
from tests.support.store_writer import calibration
from touchline.core.errors import BadInput, Conflict, Unavailable
from touchline.core.geometry import ImageSize
from touchline.store.archive import UNFINISHED, restore_into
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store

SIZE = ImageSize(640, 480)


@pytest.fixture
def filled(opener, tmp_path):
    """A store with something of everything."""
    with opener(tmp_path / "data") as store:
        snapshot = store.snapshots.add(
            b"picture" * 900, SIZE, "jpeg", camera="north", purpose="board"
        )
        store.drafts.save(
            snapshot.id, {**EMPTY, "field": "f"}, store.drafts.get(snapshot.id).etag, by="Anna"
        )
        kept = [store.calibrations.add(calibration("north", f"{k}"), by="Anna") for k in range(3)]
        store.calibrations.activate(kept[1].id)
        store.calibrations.delete(kept[0].id)
        store.lenses.add({"model": "ssl"})
        store.cameras.add("west", {"name": "West"})
        store.identities.confirm("west", {"serial": "A1"})
        yield store


def zipped(store, tmp_path, fields=None):
    path = tmp_path / "all.zip"
    path.write_bytes(b"".join(store.archive(fields)))
    return path


def everything(store):
    return (
        store.snapshots.list().items,
        [store.drafts.get(s.id) for s in store.snapshots.list().items],
        store.calibrations.list().items,
        store.lenses.list().items,
        store.cameras.all(),
        store.identities.get("west"),
        store.calibrations.history("north"),
    )


@pytest.mark.parametrize("target", ["sqlite", "postgresql"])
def test_an_archive_is_restored_on_a_bare_machine_on_either_database(
    filled, tmp_path, request, target
):
    path = zipped(filled, tmp_path)
    opener = StoreOpener(request.getfixturevalue("postgres") if target == "postgresql" else None)
    bare = tmp_path / "bare"
    counts = restore_into(path, bare, opener.address(bare))
    assert counts["calibrations"] == 3 and counts["activations"] == 1
    with opener(bare) as again:
        assert everything(again) == everything(filled) and again.damaged == ()
        assert again.snapshots.picture(filled.snapshots.list().items[0].id) == b"picture" * 900
        assert again.calibrations.add(calibration("north", "next")).version == 4
        assert count_rows(again)["calibrations"] == 4


def test_nothing_is_restored_over_something(filled, tmp_path, opener):
    path = zipped(filled, tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    (other / "note.txt").write_text("mine")
    with pytest.raises(Conflict) as told:
        restore_into(path, other, None)
    assert told.value.reason == "folder-not-empty" and [p.name for p in other.iterdir()] == [
        "note.txt"
    ]


def test_the_operators_fields_come_with_it(filled, tmp_path):
    from touchline.installation import shipped

    (tmp_path / "fields").mkdir()
    text = (
        (shipped("configs") / "fields" / "table.yaml")
        .read_text()
        .replace("name: table", "name: mine")
    )
    (tmp_path / "fields" / "mine.yaml").write_text(text)
    # and is told there as it is here
    (tmp_path / "fields" / "unreadable.yaml").write_text("name: [")
    path = zipped(filled, tmp_path, tmp_path / "fields")
    restore_into(path, tmp_path / "bare", None)
    assert (tmp_path / "bare" / "fields" / "mine.yaml").read_text() == text
    assert (tmp_path / "bare" / "fields" / "unreadable.yaml").read_text() == "name: ["


def rewritten(path, change):
    """The archive with its members changed: change(name, data) → data, or None to leave it out."""
    with zipfile.ZipFile(path) as source:
        members = {name: source.read(name) for name in source.namelist()}
    other = path.with_name("other.zip")
    with zipfile.ZipFile(other, "w") as out:
        for name, data in members.items():
            if (data := change(name, data)) is not None:
                out.writestr(name, data)
    return other


def later(name, data):
    return (
        json.dumps({**json.loads(data), "form": "0999"}).encode()
        if name == "touchline.json"
        else data
    )


BAD = {
    "cut": lambda p: _cut(p),
    "text": lambda p: _text(p),
    "without its end": lambda p: rewritten(p, lambda n, d: None if n == "end.json" else d),
    "a row changed": lambda p: rewritten(
        p, lambda n, d: d.replace(b"north", b"south") if "calibr" in n else d
    ),
    "a row missing": lambda p: rewritten(
        p, lambda n, d: d.partition(b"\n")[2] if "calibrations" in n else d
    ),
    "a picture changed": lambda p: rewritten(
        p, lambda n, d: b"x" + d[1:] if n.startswith("pictures/") else d
    ),
    "no JSON": lambda p: rewritten(p, lambda n, d: b"{" if n == "touchline.json" else d),
    "a head of 50 MB": lambda p: rewritten(
        p, lambda n, d: b" " * 50_000_000 + d if n == "touchline.json" else d
    ),
    "a row of 65 MB": lambda p: rewritten(
        p, lambda n, d: d.replace(b"{", b"{" + b" " * (65 << 20), 1) if "calibrations" in n else d
    ),
    "deep JSON": lambda p: rewritten(p, lambda n, d: b"[" * 100_000 if n == "end.json" else d),
    "a deep row": lambda p: rewritten(
        p, lambda n, d: b"[" * 100_000 + b"\n" + d if "lenses" in n else d
    ),
    "a member of no zlib": lambda p: _broken(p),
    "of a later form": lambda p: rewritten(p, later),
}


def _cut(path):
    path.write_bytes(path.read_bytes()[:-300])
    return path


def _broken(path):
    """What was compressed is overwritten: the names are there, and what they stand for is not."""
    with zipfile.ZipFile(path) as source:
        begin = source.getinfo("tables/calibrations.jsonl").header_offset + 80
    data = bytearray(path.read_bytes())
    data[begin : begin + 60] = b"\xff" * 60
    path.write_bytes(data)
    return path


def _text(path):
    path.write_text("no zip")
    return path


@pytest.mark.parametrize("how", BAD)
def test_an_archive_that_is_not_whole_is_refused_and_leaves_nothing(filled, tmp_path, how):
    path = BAD[how](zipped(filled, tmp_path))
    with pytest.raises((BadInput, Conflict, Unavailable)) as told:
        restore_into(path, tmp_path / "bare", None)
    assert told.value.fix
    assert not (tmp_path / "bare").exists()


def test_what_a_restore_left_that_was_killed_is_not_opened(tmp_path):
    (tmp_path / UNFINISHED).touch()
    with pytest.raises(Unavailable) as refused:
        Store(tmp_path)
    assert refused.value.reason == "restore-unfinished"


def test_a_name_in_an_archive_never_leads_out_of_the_folder(filled, tmp_path):
    path = rewritten(zipped(filled, tmp_path), lambda n, d: d)
    with zipfile.ZipFile(path, "a") as out:
        for name in (
            "../outside",
            "pictures/../../outside",
            "fields/../../outside.yaml",
            "/tmp/outside",
        ):
            out.writestr(name, b"x")
    restore_into(path, tmp_path / "deep" / "bare", None)
    assert not list(tmp_path.rglob("outside*"))


def test_a_picture_that_was_lost_before_is_named_and_the_rest_is_there(filled, tmp_path):
    (picture,) = (filled.folder / "pictures").iterdir()
    picture.unlink()
    path = zipped(filled, tmp_path)
    with zipfile.ZipFile(path) as source:
        assert json.loads(source.read("end.json"))["missing"] == [picture.name]
    assert restore_into(path, tmp_path / "bare", None)["snapshots"] == 1


def test_the_shell_archives_and_restores(touchline, tmp_path):
    with Store(tmp_path / "data") as store:
        kept = store.calibrations.add(calibration("north", "1"))
        camera = store.cameras.add("north", {"source": "rtsp://op:s3cret@cam/"})
    assert (
        touchline("archive", "all.zip", "--data", "nowhere")[0] == 4
        and not (tmp_path / "nowhere").exists()
    )
    assert touchline("archive", "all.zip", "--data", "data")[0] == 0
    code, _, said = touchline("restore", "all.zip", "--data", "bare")
    assert code == 0 and "1 calibrations" in said
    assert touchline("restore", "all.zip", "--data", "bare")[0] == 4
    assert touchline("archive", "whole.zip", "--data", "data", "--passwords")[0] == 0
    assert touchline("restore", "whole.zip", "--data", "whole")[0] == 0
    with Store(tmp_path / "bare") as again, Store(tmp_path / "whole") as whole:
        assert again.calibrations.get(kept.id) == kept
        assert (
            again.cameras.get("north").body == {"source": "rtsp://op@cam/"}
            and whole.cameras.get("north") == camera
        )
