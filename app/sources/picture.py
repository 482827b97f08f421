"""picture://NAME: a picture file, shown again and again as a camera that looks at one thing."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import cv2
import numpy as np

from app.errors import NotFound, Unavailable
from app.models import Option
from app.records import Frame
from app.sources import PlainSource, Surroundings

MAX_BYTES = 64 * 1024 * 1024


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
        if around.decode is None or around.pictures is None:
            raise Unavailable("No folder of pictures is set.", "Name one in the settings.", reason="no-pictures")
        with _within(around.pictures, target).open("rb") as file:
            raw = file.read(MAX_BYTES + 1)  # the decoder refuses what is too long
        return cls(around.decode(raw), options["fps"])

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


def _within(folder: Path, name: str) -> Path:
    """The regular file of that name in the folder; a link or a path that leads out of it is not found."""
    try:
        root = folder.resolve(strict=True)
        path = (root / name).resolve(strict=True)
        if path.is_relative_to(root) and path.is_file():
            return path
    except (OSError, ValueError, RuntimeError):  # missing, a NUL, a loop of links
        pass
    raise NotFound(f"There is no picture {name!r} in the pictures folder.", "Put it there, or correct the name.",
                   reason="unknown-picture")
