"""What sources share: a frame rate of their own, pictures as they come, refusals of reads and of controls."""

import time
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.core.records import Frame
from touchline.core.sentences import OPEN_AGAIN
from touchline.core.statements import say

T = TypeVar("T")
TRY_S = 1.0  # between two pictures that are decoded to see what they are


def unknown_control(name: Any, known: Iterable[str]) -> NotFound:
    """Return the error for a control that this camera lacks."""
    names = list(known)
    return NotFound(
        say("control.unknown", "This camera has no setting called {name!r}.", name=str(name)[:40]),
        say("control.known", "It has: {names}.", names=names)
        if names
        else say("control.none", "It has no settings that can be changed."),
        reason="unknown-control",
    )


def refused_value(label: str, value: str, allowed: str) -> BadInput:
    """Return the error for a value that a control cannot have. value: as it is quoted."""
    return BadInput(
        f"{label} cannot be {value} on this camera.", f"Use {allowed}.", reason="bad-control"
    )


def is_number(value: Any, low: float, high: float) -> bool:
    """Tell whether a control's value is a number in this range."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and low <= value <= high


class Pacer:
    """Keeps a source at its frame rate, without catching up on frames that were late."""

    def __init__(self) -> None:
        self._due_s = time.monotonic()

    def wait(self, fps: float) -> None:
        """Wait until the next frame is due."""
        time.sleep(max(0.0, self._due_s - time.monotonic()))
        self._due_s = max(self._due_s + 1 / fps, time.monotonic())


class PictureReader:
    """Reads a camera's pictures as they come; one a second is decoded, to see whether they are pictures at all.

    read_image: screens one, and decodes it when its pixels are wanted.
    """

    def __init__(self, read_image: Callable[[bytes], Frame]) -> None:
        self._read_image = read_image
        self._try_at_s = 0.0

    def read(self, data: bytes) -> Frame:
        """Return the picture. BadImage where it is none; after one that was none, each is tried until one is."""
        frame = self._read_image(data)
        if (now := time.monotonic()) >= self._try_at_s:
            _ = frame.pixels
            self._try_at_s = now + TRY_S
        return frame


def require_decoder(decode: T | None) -> T:
    """Return what decodes images; Unavailable where there is nothing that does."""
    if decode is None:
        raise Unavailable(
            say("network.no-decoder", "Images cannot be decoded."),
            say("network.restart-touchline", "Restart Touchline."),
            reason="no-decoder",
        )
    return decode


def require_open(handle: T | None, kind: str = "camera") -> T:
    """Return what an open source reads from; Unavailable where it is None, since the source is closed."""
    if handle is None:
        raise Unavailable(f"This {kind} is closed.", OPEN_AGAIN, reason="source-closed")
    return handle
