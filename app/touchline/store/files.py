"""Files written atomically: under another name, flushed, moved into place, and the folder flushed as well; and read.

A reader therefore sees the old file or the new one, also after a power cut in between. Without the last flush
the new name could be lost again although its content was safe.
"""

import errno
import hashlib
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from touchline.core.errors import BadInput, DiskFull, NotFound, Unavailable
from touchline.core.sentences import image_name
from touchline.core.statements import join, say
from touchline.core.strict_yaml import MAX_BYTES, plain_from_yaml
from touchline.store.saved_things import because, not_saved

T = TypeVar("T")
TEMPORARY = ".tmp"
DISK_IS_FULL = say("disk.is-full", "the disk is full.")
FREE_SPACE = say("disk.free-space", "Free some space on the disk of the data folder, then try again.")
CHECK_DISK = say("disk.check", "Check the disk and the permissions of the data folder, then try again.")
UPLOAD_AGAIN = say("file.upload-again", "Upload it again.")


def write_atomically(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write the file; on return it survives a power cut. On OSError the old file is still there.

    mode: who may read and write it, less what the process' umask takes away.
    """
    temporary = path.parent / f".{secrets.token_hex(8)}{TEMPORARY}"
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
    try:
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest):]
            os.fsync(handle)
        finally:
            os.close(handle)
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(temporary)
        raise
    sync_folder(path.parent)


def replace_synced(path: Path, target: Path) -> None:
    """Flush a file that a library has written, and move it into place within its folder."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(path, target)
    sync_folder(target.parent)


def move_durably(path: Path, target: Path) -> None:
    """Move a file to another folder of the same disk; on return the move survives a power cut.

    It may have been moved before by a call that failed later on.
    """
    try:
        os.replace(path, target)
    except FileNotFoundError:
        if not target.exists():
            raise
    sync_folder(target.parent)
    sync_folder(path.parent)


def make_folder(path: Path) -> Path:
    """Make the folder, and those above it, where missing; return it."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(exist_ok=True)
        sync_folder(path.parent)
    return path


def sync_folder(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove_temporary_files(folder: Path) -> None:
    """Remove the unfinished files of writers that were killed; only while there is no other writer."""
    for path in folder.glob(f".*{TEMPORARY}"):
        path.unlink(missing_ok=True)


@contextmanager
def translate_disk_errors(what: str) -> Iterator[None]:
    """Raise DiskFull or Unavailable for an OSError. what: what was to be saved, such as "The calibration"."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise DiskFull(join(not_saved(what), DISK_IS_FULL), FREE_SPACE) from error
        raise Unavailable(join(not_saved(what), because(error.strerror or str(error))),
                          CHECK_DISK, reason="not-saved") from error


def read_yaml(path: Path, parse: Callable[[Any], T], what: str, reason: str) -> T:
    """Parse one YAML file; the errors name the file. what, reason: how NotFound calls it where it cannot be read."""
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise NotFound(f"{what} cannot be read: {error.strerror}.", "Check the file and its permissions.",
                       reason=reason) from None
    return parse_yaml(raw, parse, path.name)


def parse_yaml(raw: bytes, parse: Callable[[Any], T], name: str) -> T:
    """Parse what a YAML file of that name holds, or is to hold; the errors name the file."""
    try:
        return parse(plain_from_yaml(raw, f"The file {name}"))
    except BadInput as error:
        raise BadInput(f"{name}: {error.what}", error.fix, reason=error.reason) from None


def read_checked(name: str, path: str, sha256: str) -> bytes:
    """Return a stored picture's bytes in another process than the one that opened the store. name: for the error."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise cannot_read(name, error) from None
    if hashlib.sha256(data).hexdigest() != sha256:
        raise Unavailable(say("file.damaged", "{name} is damaged.", name=image_name(name.capitalize())),
                          UPLOAD_AGAIN, reason="damaged-file")
    return data


def cannot_read(name: str, error: OSError) -> Unavailable:
    """Return the error for a stored picture whose bytes are not there, or not to be had."""
    return Unavailable(say("file.cannot-read", "{name} cannot be read: {error}.", name=image_name(name.capitalize()),
                           error=error.strerror), UPLOAD_AGAIN, reason="damaged-file")
