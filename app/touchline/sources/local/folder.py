"""folder://NAME: the pictures of a folder one after the other, as if a camera had just taken them."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from touchline.core.errors import BadImage, NotFound, TouchlineError, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import join, say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import Pacer, require_decoder, require_open
from touchline.sources.local.files import by_name, file_within, folder_within, pictures_folder, read_bytes

SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".webp"}
MAX_PICTURES = 100_000


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
            raise Unavailable(say("folder.ended", "The last image has been shown."),
                              say("folder.open-again", "Open the folder again, or with loop=true."),
                              reason="source-ended")
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
                    frame = self._decode(read_bytes(file_within(pictures_folder(self._context), name)))
                except (BadImage, NotFound, Unavailable) as error:  # broken, or taken away meanwhile
                    broken = error
                    self.skipped += 1
                    continue
                came = True
                yield frame
            if broken is not None and not came:
                raise Unavailable(join(say("folder.none-readable", "None of the images in {folder!r} can be read.",
                                           folder=self._target), broken.what, broken.fix),
                                  say("folder.add-images", "Add images to the folder."), reason="no-pictures-there")
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
            raise Unavailable(say("folder.too-many-images", "The folder {folder!r} contains {images} images.",
                                  folder=self._target, images=len(found)) if found
                              else say("folder.no-images", "The folder {folder!r} contains no images.",
                                       folder=self._target),
                              say("folder.put-images", "Put 1 to {most} PNG, JPEG, BMP or WebP files in it.",
                                  most=MAX_PICTURES), reason="no-pictures-there")
        return [str(path.relative_to(root)) for path in sorted(found, key=by_name)]
