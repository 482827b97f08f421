"""What another publisher's geometry adds to ours, saved over a restart."""

import json
import logging
import time
from pathlib import Path

from touchline.core.errors import TouchlineError
from touchline.league.packet import PassedOn
from touchline.services.saved_settings import read_object
from touchline.store.files import RecentFailures, write_atomically

log = logging.getLogger("touchline")


class SavedPassedOn:
    """The file of it. path: where."""

    def __init__(self, path: Path, failures: RecentFailures) -> None:
        self.path, self._failures = path, failures
        self._saved: PassedOn | None = None

    def read(self) -> PassedOn | None:
        """Return what was saved within a day; None for anything else."""
        try:
            self._saved = PassedOn.from_saved(read_object(self.path), time.time())
        except (ValueError, RecursionError, OSError):
            self._saved = None
        return self._saved

    def save(self, found: PassedOn) -> None:
        """Save it where it says something new; a failure is noted, and it is tried again with the next news."""
        if not found.needs_saving(self._saved):
            return
        try:
            with self._failures.noted("The heard geometry"):
                write_atomically(self.path, json.dumps(found.saved()).encode())
        except TouchlineError as problem:
            log.warning("%s", problem)
        self._saved = found
