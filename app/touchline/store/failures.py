"""What could not be read or saved lately, so that it is told to all and not only to whoever asked for it."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic

from touchline.core.errors import TouchlineError, Unavailable
from touchline.core.records import Warning
from touchline.store.files import translate_disk_errors

TOLD_S = 300.0  # longer than any page waits between two looks at the list of problems
DAMAGED = "database-damaged"  # told until another database is in its place


class RecentFailures:
    """The last failure of each reason. Thread-safe."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[float, TouchlineError]] = {}

    def note(self, error: TouchlineError) -> None:
        """Remember one from now on."""
        self._last[error.reason] = (monotonic(), error)

    def forget(self) -> None:
        """Forget all: another database is in the place of the one that failed."""
        self._last.clear()

    @contextmanager
    def noted(self, what: str) -> Iterator[None]:
        """Raise what translate_disk_errors makes of an OSError, and remember it."""
        try:
            with translate_disk_errors(what):
                yield
        except Unavailable as error:
            self.note(error)
            raise

    def warnings(self) -> tuple[Warning, ...]:
        """Return what an operator should know: each failure until some minutes have passed without another."""
        since_s = monotonic() - TOLD_S
        return tuple(Warning(reason, error.what, error.fix) for reason, (at_s, error) in list(self._last.items())
                     if at_s > since_s or reason == DAMAGED)
