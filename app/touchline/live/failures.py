"""In a camera's process: what its threads have survived. One picture like no other must not end any of them."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from touchline.core.statements import say, sentence_in, stated
from touchline.live.messages import Failure, FailuresJson
from touchline.vision.zones import Advice, message

RECENT_S = 5.0  # longer ago, it is over
RESTART_OR_REPORT = say(
    "camera-failure.restart-or-report",
    "Restart the camera or free memory on the server. If the "
    "problem remains, report the server's log.",
)


class Failures:
    """Counts failures and remembers the newest one. Any thread may call it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0
        self._newest: tuple[str, str, float] | None = None

    @contextmanager
    def surviving(self, what: str) -> Iterator[None]:
        """Count an error instead of raising it. what: a sentence without its full stop, such as "No frame is sent"."""
        try:
            yield
        except Exception as error:  # whatever it is, the next picture may be better
            self.add(what, error)

    def add(self, what: str, error: Exception) -> None:
        with self._lock:
            self._count += 1
            self._newest = what, type(error).__name__, time.monotonic()

    def to_json(self) -> FailuresJson:
        with self._lock:
            count, newest = self._count, self._newest
        if newest is None:
            return {"count": count, "newest": None}
        what, error, at_s = newest
        return {
            "count": count,
            "newest": stated(
                Failure(what=what, error=error, is_recent=time.monotonic() - at_s < RECENT_S)
            ),
        }


def failure_words(failures: FailuresJson | None) -> list[Advice]:
    """Return what the camera says of a failure that still goes on: as light and focus are said."""
    newest = failures and failures["newest"]
    if not newest or not newest["is_recent"]:
        return []
    return [
        message(
            say(
                "camera-failure.said",
                "{failure}: {error}.",
                failure=sentence_in(newest, "what"),
                error=newest["error"],
            ),
            RESTART_OR_REPORT,
            True,
        )
    ]
