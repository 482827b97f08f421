"""Files written atomically, how much of the disk they may take, and what could not be read or saved lately.

A file is written under another name, flushed and moved into place, then its folder is flushed: a reader sees the old
file or the new one, also after a power cut in between. Without the last flush the new name could be lost again although
its content was safe.
"""

import errno
import hashlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

from touchline.core.errors import BadInput, DiskFull, NotFound, TouchlineError, Unavailable
from touchline.core.records import Warning
from touchline.core.sentences import image_name
from touchline.core.statements import Sentence, join, say
from touchline.core.strict_yaml import MAX_BYTES, plain_from_yaml

CODES = {
    "The archive": "saved.archive",
    "The calibration": "saved.calibration",
    "The camera": "saved.camera",
    "The camera's identity": "saved.camera-identity",
    "The cancelling": "saved.cancelling",
    "The clip": "saved.clip",
    "The colour profile": "saved.colour-profile",
    "The database": "saved.database",
    "The deletion": "saved.deletion",
    "The detection plan": "saved.detection-plan",
    "The draft": "saved.draft",
    "The field": "saved.field",
    "The job": "saved.job",
    "The lens": "saved.lens",
    "The mark of a damaged row": "saved.mark",
    "The note": "saved.note",
    "The result": "saved.result",
    "The rig": "saved.rig",
    "The roll": "saved.roll",
    "The setting": "saved.setting",
    "The snapshot": "saved.snapshot",
    "The undoing of the deletion": "saved.undoing",
}

T = TypeVar("T")
TEMPORARY = ".tmp"
DISK_IS_FULL = say("disk.is-full", "the disk is full.")
FREE_SPACE = say(
    "disk.free-space", "Free some space on the disk of the data folder, then try again."
)
CHECK_DISK = say(
    "disk.check", "Check the disk and the permissions of the data folder, then try again."
)
UPLOAD_AGAIN = say("file.upload-again", "Upload it again.")

SHOWN_S = 300.0  # longer than any page waits between two looks at the list of problems
DAMAGED = "database-damaged"  # told until another database is in its place

MB = 1_000_000
WARN_FREE_BYTES = 500 * MB
# below that a picture is refused: a calibration needs some KB and finds them
MIN_FREE_BYTES = 100 * MB
UPLOADS_BYTES = 2000 * MB
BACKUPS_BYTES = 1000 * MB


def not_saved(what: str) -> Sentence:
    """Return how an error begins. what: as in CODES; another word is stated as it is."""
    return say(
        "saved.not", "{what} was not saved:", what=say(CODES[what], what) if what in CODES else what
    )


def because(error: str) -> Sentence:
    """Return how an error goes on."""
    return say("disk.cause", "{error}.", error=error)


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
                rest = rest[os.write(handle, rest) :]
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
        raise Unavailable(
            join(not_saved(what), because(error.strerror or str(error))),
            CHECK_DISK,
            reason="not-saved",
        ) from error


def read_yaml(path: Path, parse: Callable[[Any], T], what: str, reason: str) -> T:
    """Parse one YAML file; the errors name the file. what, reason: how NotFound calls it where it cannot be read."""
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise NotFound(
            f"{what} cannot be read: {error.strerror}.",
            "Check the file and its permissions.",
            reason=reason,
        ) from None
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
        raise Unavailable(
            say("file.damaged", "{name} is damaged.", name=image_name(name.capitalize())),
            UPLOAD_AGAIN,
            reason="damaged-file",
        )
    return data


def cannot_read(name: str, error: OSError) -> Unavailable:
    """Return the error for a stored picture whose bytes are not there, or not to be had."""
    return Unavailable(
        say(
            "file.cannot-read",
            "{name} cannot be read: {error}.",
            name=image_name(name.capitalize()),
            error=error.strerror,
        ),
        UPLOAD_AGAIN,
        reason="damaged-file",
    )


class RecentFailures:
    """The last failure of each reason. Thread-safe."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[float, TouchlineError]] = {}

    def note(self, error: TouchlineError) -> None:
        """Remember one from now on."""
        self._last[error.reason] = (monotonic(), error)

    def forget(self) -> None:
        """Forget all: another database is in the place of the one that failed."""
        self._last.clear()

    @contextmanager
    def noted(self, what: str) -> Iterator[None]:
        """Raise what translate_disk_errors makes of an OSError, and remember it."""
        try:
            with translate_disk_errors(what):
                yield
        except Unavailable as error:
            self.note(error)
            raise

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know: each failure until some minutes have passed without another."""
        since_s = monotonic() - SHOWN_S
        return tuple(
            Warning(reason, error.what, error.fix)
            for reason, (at_s, error) in list(self._last.items())
            if at_s > since_s or reason == DAMAGED
        )


def free_bytes(folder: Path) -> int:
    return shutil.disk_usage(folder).free


class PictureQuota:
    """quota_bytes: for all pictures together. free: returns how much is left on a folder's disk, bytes."""

    def __init__(
        self,
        folder: Path,
        quota_bytes: int = UPLOADS_BYTES,
        free: Callable[[Path], int] = free_bytes,
    ) -> None:
        self._folder = folder
        self._free = free
        self.quota_bytes = quota_bytes
        self.used_bytes = 0

    def count(self, pictures: Path) -> None:
        """Count how much the pictures take."""
        self.used_bytes = sum(path.stat().st_size for path in pictures.iterdir())

    def added(self, size_bytes: int) -> None:
        self.used_bytes += size_bytes

    def over_by(self, size_bytes: int) -> int:
        """Return by how much one more picture would exceed the quota, bytes; not above 0 where it fits."""
        return self.used_bytes + size_bytes - self.quota_bytes

    def check_free(self) -> None:
        """Raise DiskFull where a picture would take what calibrations may need; OSError without the folder."""
        if self._free(self._folder) < MIN_FREE_BYTES:
            raise DiskFull(
                say(
                    "disk.image-refused",
                    "The image was not saved. Less than {free_mb} MB are free on the disk.",
                    free_mb=MIN_FREE_BYTES // MB,
                ),
                say(
                    "disk.free-space-calibrations",
                    "Free some space on the disk of the data folder, then "
                    "try again. Calibrations can still be saved.",
                ),
            )

    def refusal(self) -> DiskFull:
        return DiskFull(
            say(
                "disk.quota-in-use",
                "The image was not saved. Images use {used_mb:.0f} MB, and all of them are in use.",
                used_mb=self.used_bytes / MB,
            ),
            say(
                "disk.increase-quota",
                "Increase uploads_mb in the settings, or download all data and "
                "start with a new data folder.",
            ),
            reason="uploads-full",
        )

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know about the disk."""
        free = self._free(self._folder)
        if free >= WARN_FREE_BYTES:
            return ()
        more = say("disk.images-refused", "New images are refused. Calibrations are still saved.")
        return (
            Warning(
                "disk-nearly-full",
                join(
                    say(
                        "disk.nearly-full",
                        "{mb} MB are free on the disk of the data folder.",
                        mb=free // MB,
                    ),
                    more if free < MIN_FREE_BYTES else "",
                ),
                say("disk.free-some", "Free some space there."),
            ),
        )
