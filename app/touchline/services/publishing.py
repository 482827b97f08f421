"""Publishing settings that operators have changed, saved over a restart; they win over the settings file by name."""

import json
import logging
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from touchline.core.errors import BadInput, TouchlineError
from touchline.core.field import Field
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.league.config import PublishingConfig
from touchline.league.passed_on import PassedOn
from touchline.league.publishing import Publishing
from touchline.services.cameras import CameraService
from touchline.settings import Settings
from touchline.store.files import write_atomically
from touchline.store.repository import check_etag, content_etag
from touchline.store.store import Store

log = logging.getLogger("touchline")
FILE = "publishing.json"
HEARD_FILE = "heard-geometry.json"  # what another publisher's geometry adds to ours
MERGED = ("numbers", "approved")  # by camera: those not named stay, null removes one


class PublishingService:
    """The saved configuration, and the publisher that follows it. Thread-safe."""

    def __init__(self, settings: Settings, store: Store, cameras: CameraService,
                 fields: Mapping[str, Field]) -> None:
        self._path = settings.data / FILE
        self._own = settings.publish
        self._failures = store.failures
        self._references, self._fields = store.references, fields
        self._lock = threading.Lock()
        self._damage: tuple[Warning, ...] = ()
        self._changes: dict[str, Any] = {}

        self._heard_path = settings.data / HEARD_FILE
        self.publisher = Publishing(self._read(), cameras.active_calibrations, fields, self._read_heard(),
                                    self._keep_heard)

    def change(self, changes: Mapping[str, Any], check: bool = True, etag: str | None = None) -> None:
        """Save and apply; BadInput, NotFound, or NetworkError for what this network does not carry now.

        etag: of the settings that the caller saw; Stale if they are others by now. Nothing is saved or applied where
        anything is refused.
        """
        with self._references, self._lock:
            if changes.get("field") is not None:
                _ = self._fields[changes["field"]]
            before = self.publisher.config
            check_etag(etag, content_etag(before.to_json()), say("stale.publishing", "Another user has changed the "
                       "publishing settings since you opened them."), "stale-publishing", before.to_json())
            saved = {**self._changes, **changes}
            for name in MERGED:
                if name in changes:
                    merged = {**getattr(before, name), **changes[name]}
                    saved[name] = {key: value for key, value in merged.items() if value is not None}
            config = PublishingConfig.from_json({**self._own.to_json(), **saved})
            if check:
                self.publisher.check(config)
            with self._failures.noted("The setting"):
                write_atomically(self._path, json.dumps(saved, indent=1).encode())
            self._changes, self._damage = saved, ()
            if config != before:
                self.publisher.apply(config)

    @property
    def etag(self) -> str:
        """The ETag of the settings."""
        return content_etag(self.publisher.config.to_json())

    @property
    def warnings(self) -> tuple[Warning, ...]:
        return (*self._damage, *self.publisher.warnings)

    def _keep_heard(self, found: PassedOn) -> None:
        try:
            with self._failures.noted("The heard geometry"):
                write_atomically(self._heard_path, json.dumps(found.saved()).encode())
        except TouchlineError as problem:  # it is passed on all the same, until the next start
            log.warning("%s", problem)

    def _read_heard(self) -> PassedOn | None:
        try:
            return PassedOn.from_saved(_read_object(self._heard_path), time.time())
        except (ValueError, RecursionError, OSError):
            return None

    def _read(self) -> PublishingConfig:
        """Read what was saved. A damaged file is left as it is, and nothing is sent until somebody has looked."""
        try:
            self._changes = _read_object(self._path)
            return PublishingConfig.from_json({**self._own.to_json(), **self._changes})
        except (BadInput, ValueError, RecursionError, OSError):
            self._changes = {}
            self._damage = (Warning("publishing-damaged",
                                    say("publishing.damaged", "{file} in the data folder cannot be read. Nothing is "
                                        "published.", file=self._path.name),
                                    say("publishing.restore-settings", "Enter the publishing settings again, or "
                                        "correct the file and restart the server.")),)
            return PublishingConfig()


def _read_object(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    value = json.loads(path.read_bytes())
    if not isinstance(value, dict):
        raise ValueError
    return value
