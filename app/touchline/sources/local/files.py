"""Files that sources may read: those in the pictures folder and nowhere else, whatever a name or a link says."""

import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from touchline.core.errors import NotFound, Unavailable
from touchline.core.statements import say
from touchline.sources import SourceContext

MAX_BYTES = 64 * 1024 * 1024  # of a picture; the decoder has its own limit


def pictures_folder(context: SourceContext) -> Path:
    """Return the only folder that is read; Unavailable where none is set."""
    if context.pictures is None:
        raise Unavailable(say("files.folder-not-set", "No pictures folder is set."),
                          say("files.enter-folder", "Enter it in the settings."), reason="no-pictures")
    return context.pictures


def file_within(folder: Path, name: str, kind: str = "picture") -> Path:
    """Return a regular file in the folder; a link or path that leads out of it is not found."""
    return _within(folder, name, Path.is_file, kind, "Put")


def folder_within(folder: Path, name: str) -> Path:
    """Return a folder in the folder, "." being itself, under the same rule."""
    return _within(folder, name, Path.is_dir, "folder", "Make")


def read_bytes(path: Path) -> bytes:
    """Return a picture's bytes, at most one more than the decoder accepts; Unavailable when unreadable."""
    try:
        with path.open("rb") as file:
            return file.read(MAX_BYTES + 1)  # the decoder refuses what is too long
    except OSError:
        raise Unavailable(say("files.unreadable", "The image {name!r} cannot be read.", name=path.name),
                          say("files.check-permissions", "Check its permissions."), reason="unreadable-file") from None


def by_name(path: Path) -> list[int | str]:
    """Return a sort key in which img2 comes before img10."""
    parts = re.split(r"([0-9]+)", path.name)
    return [int(part) if i % 2 else part.casefold() for i, part in enumerate(parts)]


def _within(folder: Path, name: str, is_one: Callable[[Path], bool], kind: str, deed: str) -> Path:
    with suppress(OSError, ValueError, RuntimeError):  # missing, a NUL, a loop of links
        root = folder.resolve(strict=True)
        path = (root / name).resolve(strict=True)
        if path.is_relative_to(root) and is_one(path):
            return path
    raise NotFound(say(f"files.no-{kind}", f"There is no {kind} {{name!r}} in the pictures folder.", name=name),
                   say(f"files.{deed.lower()}-there", f"{deed} it there, or check the name."), reason=f"unknown-{kind}")
