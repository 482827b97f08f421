"""Cameras' passwords: encrypted at rest, left out of archives, and missing where the key is."""

import json
import zipfile
from dataclasses import replace

import pytest

from tests.support.store_opener import damage_row
from touchline.store.archive import restore_into
from touchline.store.cameras import FILE
from touchline.store.integrity import update_checksum
from touchline.store.store import Store
from touchline.store.tables import CameraRow

SOURCE = "rtsp://op:s3cret@10.0.0.5/live?key=s3cret"
SHOWN = "rtsp://op@10.0.0.5/live?key=…"
BODY = {"name": "North half", "source": SOURCE, "field": None, "region": None}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as opened:
        opened.cameras.add("north", BODY)
        opened.cameras.add("south", {**BODY, "source": "sim://table"})
        yield opened


def save_in_clear(store, body=BODY):
    """Rewrite the row as the version before had it."""
    with store._database.writing("The camera") as rows:
        row = rows.get(CameraRow, "north")
        row.body = json.dumps(
            {"sequence": 1, "revision": 1, "updated_at": "", "updated_by": "", "camera": body}
        )
        update_checksum(row)


def files_with(secret, folder):
    return [
        str(path) for path in folder.rglob("*") if path.is_file() and secret in path.read_bytes()
    ]


def body_of(store, id="north"):
    with store._database.reading() as rows:
        return rows.get(CameraRow, id).body


def missing(store):
    return [
        warning.text for warning in store.warnings if warning.reason == "camera-password-missing"
    ]


def test_a_password_is_nowhere_in_clear_and_comes_back_after_a_restart(opener, store):
    assert store.cameras.get("north").body == store.cameras.all()[0].body == BODY
    assert json.loads(body_of(store))["camera"]["source"] == SHOWN and "s3cret" not in body_of(
        store
    )
    store.cameras.save("north", {**BODY, "name": "other"}, store.cameras.get("north").etag)
    key = store.folder / FILE
    assert key.stat().st_mode & 0o777 == 0o600
    with opener.again(store) as again:
        assert again.cameras.get("north").body == {**BODY, "name": "other"} and missing(again) == []
    assert files_with(b"s3cret", store.folder) == []
    assert files_with(key.read_bytes().strip(), store.folder) == [str(key)]


def test_a_key_that_root_makes_is_the_folders_owners(tmp_path, monkeypatch):
    given = []
    monkeypatch.setattr(
        "os.chown", lambda path, user, group: given.append((path.name, user, group))
    )
    with Store(tmp_path) as store:
        store.cameras.add("north", BODY)
    assert given == [(FILE, tmp_path.stat().st_uid, tmp_path.stat().st_gid)]


@pytest.mark.parametrize("source", [7, None, "rtsp://op:s3cret\ud800@cam/"])
def test_a_strange_address_of_an_archive_stops_nothing(opener, store, source):
    save_in_clear(store, {**BODY, "source": source})
    with opener.again(store) as again:
        assert again.cameras.get("north").body["source"] == source and "s3cret" not in body_of(
            again
        )


def test_without_a_password_there_is_no_key(tmp_path):
    with Store(tmp_path) as store:
        store.cameras.add("south", {**BODY, "source": SHOWN})
        assert store.cameras.get("south").body["source"] == SHOWN
    assert not (tmp_path / FILE).exists()


def test_what_was_saved_in_clear_is_encrypted_once_at_the_next_start(opener, store):
    save_in_clear(store)
    etag = store.cameras.get("north").etag
    assert "s3cret" in body_of(store)
    with opener.again(store) as again:
        assert "s3cret" not in body_of(again)
        assert again.cameras.get("north").body == BODY and again.cameras.get("north").etag == etag
        changes = again._database.changes()
        with opener.again(again) as third:
            assert third._database.changes() == changes and third.damaged == ()
    assert [name for name in files_with(b"s3cret", store.folder) if "backups" not in name] == []


def test_a_backup_that_has_passwords_in_clear_is_restored_with_none(tmp_path):
    with Store(tmp_path) as store:
        store.cameras.add("north", BODY)
        save_in_clear(store)
    with Store(tmp_path) as store:
        encrypted = store._database.changes()
    for backup in store._backups.all():
        if backup.changes == encrypted:
            backup.path.unlink()
    assert files_with(b"s3cret", tmp_path / "backups")
    with Store(tmp_path) as store:
        for backup in store._backups.all():
            if backup.changes == encrypted:
                backup.path.unlink()
        store.restore_backup()
        assert store.cameras.get("north").body == BODY and "s3cret" not in body_of(store)


@pytest.mark.parametrize("broken", [b"", b"no key", b"b3RoZXI" + b"A" * 36 + b"="])
def test_without_its_key_a_camera_stays_and_its_password_is_asked_for(opener, store, broken):
    key = (store.folder / FILE).read_bytes()
    store.close()
    (store.folder / FILE).write_bytes(broken) if broken else (store.folder / FILE).unlink()
    with opener(store.folder) as again:
        assert [camera.name for camera in again.cameras.all()] == [
            "north",
            "south",
        ] and again.damaged == ()
        assert again.cameras.get("north").body == {**BODY, "source": SHOWN}
        assert missing(again) == ["The password is missing for these cameras: north."]
        again.cameras.save(
            "north", {**BODY, "source": SHOWN, "name": "N"}, again.cameras.get("north").etag
        )
        assert missing(again) != []  # another name is no password
    (store.folder / FILE).write_bytes(key)
    with opener(store.folder) as again:
        assert again.cameras.get("north").body == {**BODY, "name": "N"} and missing(again) == []


def test_an_address_that_is_entered_again_gets_a_new_key(opener, store):
    store.close()
    (store.folder / FILE).write_bytes(b"no key")
    with opener(store.folder) as again:
        again.cameras.save("north", BODY, again.cameras.get("north").etag)
        assert again.cameras.get("north").body == BODY and missing(again) == []
        with opener.again(again) as third:
            assert third.cameras.get("north").body == BODY


def zipped(store, path, **how):
    path.write_bytes(b"".join(store.archive(**how)))
    with zipfile.ZipFile(path) as source:
        return b"".join(map(source.read, source.namelist()))


@pytest.mark.parametrize("clear", [False, True])
def test_an_archive_has_no_password_and_its_cameras_ask_for_them(store, tmp_path, clear):
    if clear:
        save_in_clear(store)
    inside = zipped(store, tmp_path / "all.zip")
    assert (
        b"s3cret" not in inside
        and json.loads(body_of(store)).get("encrypted", "s3cret").encode() not in inside
    )
    assert (store.folder / FILE).read_bytes().strip() not in inside
    restore_into(tmp_path / "all.zip", tmp_path / "bare", None)
    with Store(tmp_path / "bare") as again:
        assert [camera.body["source"] for camera in again.cameras.all()] == [SHOWN, "sim://table"]
        assert (
            missing(again) == ["The password is missing for these cameras: north."]
            and again.damaged == ()
        )
        etag = again.cameras.get("north").etag
        assert etag == store.cameras.get("north").etag
        again.cameras.save("north", BODY, etag)
        assert again.cameras.get("north").body == BODY and missing(again) == []


def test_an_archive_with_passwords_brings_them_to_another_machine(store, tmp_path):
    assert b"op:s3cret@" in zipped(store, tmp_path / "all.zip", passwords=True)
    restore_into(tmp_path / "all.zip", tmp_path / "bare", None)
    with Store(tmp_path / "bare") as again:
        assert [replace(a, etag="") for a in again.cameras.all()] == [
            replace(a, etag="") for a in store.cameras.all()
        ]
        assert missing(again) == [] and "s3cret" not in body_of(again)
    assert files_with(b"s3cret", tmp_path / "bare") == []


def test_what_is_left_of_a_damaged_camera_has_no_password_in_an_archive(store, tmp_path):
    save_in_clear(store)
    damage_row(store, CameraRow, lambda text: text.replace("North", "Mouth"), id="north")
    assert [camera.name for camera in store.cameras.all()] == ["south"]
    inside = zipped(store, tmp_path / "all.zip", passwords=True)
    assert b"s3cret" not in inside and b"Mouth half" in inside
