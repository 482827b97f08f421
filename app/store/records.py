"""Records as JSON files that carry their own checksum, {"sha256": of the record's text, "record": {…}}.

The form in which the store kept everything before it had a database; former.py reads it, tests write it.
"""

import json
import os
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from app.core.errors import BadInput
from app.store.files import keeping, make_folder, sweep, write_whole
from app.store.quarantine import Quarantine

HEAD = '{{"sha256":"{}","record":'
HEAD_BYTES = len(HEAD.format("0" * 64))
TAIL = b"}\n"
LONGEST_NAME = 200  # bytes; a file system takes 255, and the quarantine adds some of its own


class Records:
    """One folder of records by file name. A damaged one is moved to the quarantine when it is read."""

    def __init__(self, folder: Path, quarantine: Quarantine) -> None:
        self.folder = make_folder(folder)
        self._quarantine = quarantine
        sweep(folder)

    def names(self) -> list[str]:
        return sorted(path.name for path in self.folder.glob("*.json"))

    def read(self, name: str) -> dict[str, Any] | None:
        """The record, or None where there is no such file; DamagedFile where it is not what was written."""
        if not _is_name(name):
            return None
        path = self.folder / name
        try:
            data = path.read_bytes()
        except FileNotFoundError:
            return None
        text = data[HEAD_BYTES:-len(TAIL)]
        if data[:HEAD_BYTES] != HEAD.format(sha256(text).hexdigest()).encode() or data[-len(TAIL):] != TAIL:
            raise self._quarantine.take(path, "its checksum is wrong" if data else "it is empty")
        return json.loads(text)

    def write(self, name: str, record: Mapping[str, Any], what: str) -> None:
        """Keep the record; what: how an error calls it, such as "The draft"."""
        try:
            text = json.dumps(record, allow_nan=False, separators=(",", ":")).encode("ascii")
        except ValueError:
            raise BadInput(f"{what} contains a number that is not finite.", "Remove or correct that number.",
                           reason="non-finite-number") from None
        if not _is_name(name):
            raise BadInput(f"{what} has a name that no file can have.", "Choose small letters, digits and hyphens.",
                           reason="bad-name")
        with keeping(what):
            write_whole(self.folder / name, HEAD.format(sha256(text).hexdigest()).encode() + text + TAIL)


def _is_name(name: str) -> bool:
    """Whether it names a file of this very folder: ids come from strangers, and another's file would be taken for a
    damaged record of ours, and moved away."""
    try:
        return os.path.basename(name) == name and not name.startswith(".") and "\0" not in name \
            and 0 < len(os.fsencode(name)) <= LONGEST_NAME
    except UnicodeEncodeError:
        return False
