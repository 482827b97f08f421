"""What sources share between open and close: a frame rate of their own, and the refusal to read when closed."""

import time
from typing import TypeVar

from app.core.common_sentences import OPEN_AGAIN
from app.core.errors import Unavailable
from app.core.statements import say

T = TypeVar("T")


class Pacer:
    """Keeps a source at its frame rate, without catching up on frames that were late."""

    def __init__(self) -> None:
        self._due_s = time.monotonic()

    def wait(self, fps: float) -> None:
        """Wait until the next frame is due."""
        time.sleep(max(0.0, self._due_s - time.monotonic()))
        self._due_s = max(self._due_s + 1 / fps, time.monotonic())


def require_decoder(decode: T | None) -> T:
    """Return what decodes images; Unavailable where there is nothing that does."""
    if decode is None:
        raise Unavailable(say("network.no-decoder", "Images cannot be decoded."),
                          say("network.restart-touchline", "Restart Touchline."), reason="no-decoder")
    return decode


def require_open(handle: T | None, kind: str = "camera") -> T:
    """Return what an open source reads from; Unavailable where it is None, since the source is closed."""
    if handle is None:
        raise Unavailable(f"This {kind} is closed.", OPEN_AGAIN, reason="source-closed")
    return handle
