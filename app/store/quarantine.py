"""Damaged files are moved aside and named, never read as something else and never silently missing."""

import logging
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from app.errors import Unavailable
from app.store.files import make_folder, move_whole

log = logging.getLogger("touchline")


@dataclass(frozen=True)
class Damage:
    """A file that was moved aside: its kind (the folder it stood in) and name."""

    kind: str
    name: str

    def to_json(self) -> dict[str, str]:
        return {"kind": self.kind, "file": f"quarantine/{self.kind}/{self.name}"}


class DamagedFile(Unavailable):
    reason = "damaged-file"

    def __init__(self, damage: Damage) -> None:
        place = damage.to_json()["file"]
        super().__init__(f"A file of the data folder is damaged and was moved to {place}.",
                         "Restore it from a backup, or make it anew.", file=place)


class Quarantine:
    """The folder of damaged files, one folder in it for each that they stood in."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def take(self, path: Path, why: str) -> DamagedFile:
        """Move a damaged file aside; the error to raise, which says where it is now."""
        kind = path.parent.name
        target = make_folder(self._folder / kind) / path.name
        count = 0
        while target.exists():
            count += 1
            target = target.with_name(f"{path.name}.{count}")
        with suppress(FileNotFoundError):  # another thread has found it as well, and was faster
            move_whole(path, target)
        log.error("%s/%s is damaged (%s); it was moved to %s", kind, path.name, why, target)
        return DamagedFile(Damage(kind, target.name))

    def names(self, kind: str) -> tuple[str, ...]:
        """File names of that kind, as they stood."""
        return tuple(sorted(path.name for path in (self._folder / kind).glob("*")))

    def all(self) -> tuple[Damage, ...]:
        """Everything that was ever moved aside and is still there."""
        kinds = sorted(path.name for path in self._folder.glob("*") if path.is_dir())
        return tuple(Damage(kind, name) for kind in kinds for name in self.names(kind))

