"""picture://NAME: a picture file, shown again and again as a camera that looks at one thing."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.sources import BaseSource, SourceContext
from touchline.sources.lifecycle import Pacer, require_decoder, require_open
from touchline.sources.local.files import file_within, pictures_folder, read_bytes


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
