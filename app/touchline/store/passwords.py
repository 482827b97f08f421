"""The key with which cameras' passwords are encrypted at rest: a file of the data folder, in no backup and no archive.

Encrypted by Fernet (AES-128-CBC with HMAC-SHA256; https://github.com/fernet/spec/blob/master/Spec.md).
"""

import os
from contextlib import suppress
from pathlib import Path
from threading import Lock

from cryptography.fernet import Fernet, InvalidToken

from touchline.store.files import translate_disk_errors, write_atomically

FILE = "passwords.key"


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
        with suppress(OSError):  # root's `touchline archive` must not take the passwords from the server's own user
            owner = self._path.parent.stat()
            os.chown(self._path, owner.st_uid, owner.st_gid)
        return Fernet(key)
