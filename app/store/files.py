"""Files that are whole or not there: written beside, flushed, moved over, and the folder flushed as well.

A reader therefore sees the old file or the new one, also after a power cut in between. Without the last flush
the new name could be lost again although its content was safe.
"""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from app.core.errors import DiskFull, Unavailable

TEMPORARY = ".tmp"


def write_whole(path: Path, data: bytes) -> None:
    """Write the file; on return it survives a power cut. Raises OSError, and then the old file stands."""
    temporary = path.parent / f".{secrets.token_hex(8)}{TEMPORARY}"
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
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
    flush_folder(path.parent)


def move_whole(path: Path, target: Path) -> None:
    """Move a file to another folder of the same disk; on return the move survives a power cut.

    It may have been moved before by a call that failed later on.
    """
    try:
        os.replace(path, target)
    except FileNotFoundError:
        if not target.exists():
            raise
    flush_folder(target.parent)
    flush_folder(path.parent)


def make_folder(path: Path) -> Path:
    """The folder, with those above it, made where missing."""
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(exist_ok=True)
        flush_folder(path.parent)
    return path


def flush_folder(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def sweep(folder: Path) -> None:
    """Remove what writers that were killed have left half-written; only while no other writer is there."""
    for path in folder.glob(f".*{TEMPORARY}"):
        path.unlink(missing_ok=True)


@contextmanager
def keeping(what: str) -> Iterator[None]:
    """Tell a disk's refusal plainly; what: what was to be kept, such as "The calibration"."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            raise DiskFull(f"{what} was not saved: the disk is full.",
                           "Free some space on the disk of the data folder, then try again.") from error
        raise Unavailable(f"{what} was not saved: {error.strerror or error}.",
                          "Check the data folder's disk and permissions, then try again.",
                          reason="not-saved") from error
