"""Cameras that operators added, the evidence of which camera an id was confirmed to be, and their encrypted passwords.

Passwords are encrypted by Fernet (AES-128-CBC with HMAC-SHA256; https://github.com/fernet/spec/blob/master/Spec.md).

A camera's row has its address without the password, and beside it, encrypted, the whole address. It is "" where the
password was left out of an archive; without the key, too, the camera is there and its password is missing.
"""

import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Any

from cryptography.fernet import Fernet, InvalidToken
from sqlalchemy import delete
from sqlalchemy.orm import Session

from touchline.core.errors import NotFound, TouchlineError
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.sources.address import without_password, without_secrets
from touchline.store.documents import DocumentRepository, check_name, is_name
from touchline.store.files import translate_disk_errors, write_atomically
from touchline.store.integrity import checksummed, content, is_intact, json_text, update_checksum
from touchline.store.quarantine import DamagedFile
from touchline.store.repository import Repository, StoreContext, timestamp
from touchline.store.tables import CameraRow, IdentityRow

FILE = "passwords.key"
ENCRYPTED = "encrypted"  # in a row's JSON: the whole address
log = logging.getLogger("touchline")


class PasswordKey:
    """Thread-safe. It is read once; it is made when a password is saved for the first time."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._lock = Lock()
        self._key: Fernet | None = None

    def encrypt(self, text: str, what: str) -> str:
        """Encrypt a text. what: is to be saved, as an error calls it where the key can neither be read nor made."""
        with self._lock, translate_disk_errors(what):
            self._key = self._key or self._read() or self._make()
            return self._key.encrypt(text.encode("utf-8", "surrogatepass")).decode("ascii")

    def decrypt(self, encrypted: str) -> str | None:
        """Return the text; None without the key with which it was encrypted."""
        with self._lock, suppress(OSError, InvalidToken):
            self._key = self._key or self._read()
            if self._key is not None:
                return self._key.decrypt(encrypted.encode()).decode("utf-8", "surrogatepass")
        return None

    def _read(self) -> Fernet | None:
        """Return the key in the file; None where there is none in it, and so nothing that it could decrypt."""
        with suppress(FileNotFoundError, ValueError):
            return Fernet(self._path.read_bytes().strip())
        return None

    def _make(self) -> Fernet:
        key = Fernet.generate_key()
        write_atomically(self._path, key + b"\n", mode=0o600)
        # root's `touchline archive` must not take the passwords from the server's own user
        with suppress(OSError):
            owner = self._path.parent.stat()
            os.chown(self._path, owner.st_uid, owner.st_gid)
        return Fernet(key)


class CameraRepository(DocumentRepository):
    """Cameras in the order in which they were added; a document's name is the camera's id."""

    table, member = CameraRow, "camera"
    noun, word, plural = "camera", "camera", "cameras"
    listing = "List them with GET /api/v1/cameras."
    max_count = 10_000

    def __init__(self, store: StoreContext) -> None:
        super().__init__(store)
        self._password_key = PasswordKey(store.folder)

    def encrypt_passwords(self) -> None:
        """Encrypt what an earlier version, an archive or a backup has in clear; never an error."""
        try:
            if any(map(self._is_clear, self._find(self._select()))):
                with self._database.writing(self._what) as rows:
                    for row in filter(self._is_clear, rows.scalars(self._select())):
                        record = content(row)
                        row.body = json_text(
                            {**record, **self._saved(record[self.member], None)}, self._what
                        )
                        update_checksum(row)
        except TouchlineError as error:
            log.warning("passwords of cameras are still saved in clear: %s", error)

    def warnings(self) -> tuple[Warning, ...]:
        """Return which cameras have lost their password; nothing where the database does not answer."""
        with suppress(TouchlineError):
            if names := ", ".join(
                row.id for row in self._find(self._select()) if self._has_lost_password(row)
            ):
                return (
                    Warning(
                        "camera-password-missing",
                        say(
                            "camera.password-missing",
                            "The password is missing for these cameras: {cameras}.",
                            cameras=names,
                        ),
                        say(
                            "camera.enter-password",
                            "Enter the address of each again, with its password; or "
                            "put the file {file} back into the data folder and restart.",
                            file=FILE,
                        ),
                    ),
                )
        return ()

    def archived(self, values: Mapping[str, Any], passwords: bool) -> dict[str, Any]:
        """Return a row's columns as an archive has them. passwords: in clear, where they are known; else left out."""
        row = CameraRow(**values)
        if not _is_sound(row):
            return {**values, "body": without_secrets(row.body)}
        record = content(row)
        body = self._body(record)
        if not passwords or self._has_lost_password(row):
            has_password = ENCRYPTED in record or self._is_clear(row)
            record |= {self.member: self._shown(body)} | ({ENCRYPTED: ""} if has_password else {})
        else:
            record = {name: value for name, value in record.items() if name != ENCRYPTED} | {
                self.member: body
            }
        row.body = json_text(record, self._what)
        update_checksum(row)
        return {**values, "body": row.body, "sha256": row.sha256}

    def delete(self, name: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever) and its evidence; its calibrations stay."""
        with self._database.writing("The deletion") as rows:
            super().delete(name, etag)
            rows.execute(delete(IdentityRow).where(IdentityRow.camera == name))

    def _deleted(self, name: str) -> NotFound:
        return self._unknown(name)

    def _head(
        self, rows: Session, before: CameraRow | None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        place, revision = (
            (before.place, before.revision + 1) if before else (self._next_place(rows), 1)
        )
        return {"sequence": place, "revision": revision}, {"place": place, "revision": revision}

    def _saved(self, body: Mapping[str, Any], before: CameraRow | None) -> dict[str, Any]:
        shown = self._shown(body)
        saved: dict[str, Any] = {self.member: shown}
        if shown != body:
            saved[ENCRYPTED] = self._password_key.encrypt(body["source"], self._what)
        elif before is not None and self._has_lost_password(before):
            former = content(before)
            # changed in all but its address
            if former[self.member].get("source") == shown.get("source"):
                saved[ENCRYPTED] = former[ENCRYPTED]
        return saved

    def _body(self, record: Mapping[str, Any]) -> Mapping[str, Any]:
        body: Mapping[str, Any] = record[self.member]
        address = self._password_key.decrypt(record[ENCRYPTED]) if ENCRYPTED in record else None
        return body if address is None else {**body, "source": address}

    def _shown(self, body: Mapping[str, Any]) -> dict[str, Any]:
        source = body.get("source")
        return (
            {**body, "source": without_password(source)} if isinstance(source, str) else dict(body)
        )

    def _is_clear(self, row: CameraRow) -> bool:
        """Whether it is a row from before passwords were encrypted, and has one."""
        body = content(row).get(self.member, {}) if _is_sound(row) else {}
        return self._shown(body) != body

    def _has_lost_password(self, row: CameraRow) -> bool:
        record = content(row) if _is_sound(row) else {}
        return ENCRYPTED in record and self._password_key.decrypt(record[ENCRYPTED]) is None

    def _etag(self, record: Mapping[str, Any]) -> str:
        return f"{record['sequence']}-{record['revision']}"


def _is_sound(row: CameraRow) -> bool:
    return row.damaged is None and is_intact(row)


class IdentityRepository(Repository):
    """Which physical camera an id was confirmed to be."""

    table = IdentityRow

    def get(self, camera: str) -> dict[str, Any] | None:
        """Return the evidence that was confirmed last; None before that, or if it was damaged."""
        with self._database.reading() as rows:
            row = rows.get(IdentityRow, camera) if is_name(camera) else None
        with suppress(DamagedFile):
            return None if row is None else content(self._checked(row))["evidence"]
        return None

    def confirm(self, camera: str, evidence: Mapping[str, Any], by: str = "") -> None:
        """Let the id mean the camera with that evidence from now on. by: "" where nobody said so and it was seen."""
        check_name(camera, "The camera's identity")
        record = {
            "confirmed_at": timestamp(self._clock),
            "confirmed_by": by,
            "evidence": dict(evidence),
        }
        with self._database.writing("The camera's identity") as rows:
            rows.merge(checksummed(IdentityRow, record, "The camera's identity", camera=camera))
