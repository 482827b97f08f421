"""picture://NAME: a picture file, shown again and again as a camera that looks at one thing."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
import numpy as np

from app.core.errors import Unavailable
from app.core.options import Option
from app.core.records import Frame
from app.sources import PlainSource, Surroundings
from app.sources.local.files import file_within, pictures_folder, read_bytes


class PictureSource(PlainSource):
    """Decodes the file once and gives it as often as it is asked."""

    TITLE: ClassVar = "Picture"
    HELP: ClassVar = "A picture file in the pictures folder, as if a camera looked at it."
    TARGET: ClassVar = "the file's name"
    OPTIONS: ClassVar = (Option("fps", "float", 5.0, "Frames a second.", (0.1, 240)),)

    def __init__(self, frame: Frame, fps: float) -> None:
        self._frame: Frame | None = frame
        self._fps = fps
        self._due = time.monotonic()

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], around: Surroundings) -> Self:
        path = file_within(pictures_folder(around), target)
        return cls(around.decode(read_bytes(path)), options["fps"])

    def read(self) -> Frame:
        if self._frame is None:
            raise Unavailable("This picture is closed.", "Open it again.", reason="source-closed")
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._due = max(self._due + 1 / self._fps, time.monotonic())
        return self._frame

    def close(self) -> None:
        self._frame = None

    @classmethod
    def example(cls, folder: Path) -> str:
        (folder / "grey.png").write_bytes(cv2.imencode(".png", np.full((24, 32, 3), 128, np.uint8))[1].tobytes())
        return "picture://grey.png?fps=200"

