"""Pictures and folders as cameras: picture://NAME and folder://NAME, read in the pictures folder and nowhere else."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, Self

from touchline.core.errors import BadImage, NotFound, TouchlineError, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import join, say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import Pacer, require_decoder, require_open

MAX_BYTES = 64 * 1024 * 1024  # of a picture; the decoder has its own limit

SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".webp"}
MAX_PICTURES = 100_000


def pictures_folder(context: SourceContext) -> Path:
    """Return the only folder that is read; Unavailable where none is set."""
    if context.pictures is None:
        raise Unavailable(
            say("files.folder-not-set", "No pictures folder is set."),
            say("files.enter-folder", "Enter it in the settings."),
            reason="no-pictures",
        )
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
        raise Unavailable(
            say("files.unreadable", "The image {name!r} cannot be read.", name=path.name),
            say("files.check-permissions", "Check its permissions."),
            reason="unreadable-file",
        ) from None


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
    raise NotFound(
        say(
            f"files.no-{kind}", f"There is no {kind} {{name!r}} in the pictures folder.", name=name
        ),
        say(f"files.{deed.lower()}-there", f"{deed} it there, or check the name."),
        reason=f"unknown-{kind}",
    )


class PictureSource(BaseSource):
    """Decodes the file once and gives it as often as it is asked."""

    TITLE: ClassVar = "Image file"
    HELP: ClassVar = "An image file in the pictures folder, shown as a camera."
    TARGET: ClassVar = "the file's name"
    OPTIONS: ClassVar = (Option("fps", "float", 5.0, "Frames per second.", (0.1, 240)),)

    def __init__(self, frame: Frame, fps: float) -> None:
        self._frame: Frame | None = frame
        self._fps = fps
        self._pacer = Pacer()

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        path = file_within(pictures_folder(context), target)
        return cls(require_decoder(context.decode)(read_bytes(path)), options["fps"])

    def read(self) -> Frame:
        frame = require_open(self._frame, "picture")
        self._pacer.wait(self._fps)
        return frame

    def close(self) -> None:
        self._frame = None


class FolderSource(BaseSource):
    """One picture in memory at a time; the folder is looked through anew in each round. skipped: broken ones so far."""

    TITLE: ClassVar = "Image folder"
    HELP: ClassVar = "The images of a subfolder of the pictures folder, sorted by name."
    TARGET: ClassVar = "the folder's name"
    OPTIONS: ClassVar = (
        Option("fps", "float", 5.0, "Frames per second.", (0.1, 240)),
        Option("loop", "bool", True, "Start again after the last image."),
    )

    def __init__(self, target: str, options: Mapping[str, Any], context: SourceContext) -> None:
        self._target, self._context = target, context
        self._decode = require_decoder(context.decode)
        self._fps, self._loop = options["fps"], options["loop"]
        self._frames: Iterator[Frame] | None = self._shown()
        self._pacer = Pacer()
        self.skipped = 0

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        opened = cls(target, options, context)
        opened._names()  # so that a folder without pictures is refused at once
        return opened

    def read(self) -> Frame:
        frame = next(require_open(self._frames, "folder"), None)
        if frame is None:
            raise Unavailable(
                say("folder.ended", "The last image has been shown."),
                say("folder.open-again", "Open the folder again, or with loop=true."),
                reason="source-ended",
            )
        self._pacer.wait(self._fps)
        return frame

    def close(self) -> None:
        self._frames = None

    def _shown(self) -> Iterator[Frame]:
        while True:
            broken: TouchlineError | None = None
            came = False
            for name in self._names():
                try:
                    frame = self._decode(
                        read_bytes(file_within(pictures_folder(self._context), name))
                    )
                # broken, or taken away meanwhile
                except (BadImage, NotFound, Unavailable) as error:
                    broken = error
                    self.skipped += 1
                    continue
                came = True
                yield frame
            if broken is not None and not came:
                raise Unavailable(
                    join(
                        say(
                            "folder.none-readable",
                            "None of the images in {folder!r} can be read.",
                            folder=self._target,
                        ),
                        broken.what,
                        broken.fix,
                    ),
                    say("folder.add-images", "Add images to the folder."),
                    reason="no-pictures-there",
                )
            if not self._loop:
                return

    def _names(self) -> list[str]:
        """Paths of the pictures within the pictures folder, in order; Unavailable where there are none."""
        root = pictures_folder(self._context).resolve()
        folder = folder_within(root, self._target)
        try:
            found = [path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES]
        except OSError:
            found = []
        if not found or len(found) > MAX_PICTURES:
            raise Unavailable(
                say(
                    "folder.too-many-images",
                    "The folder {folder!r} contains {images} images.",
                    folder=self._target,
                    images=len(found),
                )
                if found
                else say(
                    "folder.no-images",
                    "The folder {folder!r} contains no images.",
                    folder=self._target,
                ),
                say(
                    "folder.put-images",
                    "Put 1 to {most} PNG, JPEG, BMP or WebP files in it.",
                    most=MAX_PICTURES,
                ),
                reason="no-pictures-there",
            )
        return [str(path.relative_to(root)) for path in sorted(found, key=by_name)]
