"""Settings of the settings file, with the changes that operators saved over them in a JSON file of the data folder."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, Self, TypeVar

from touchline.core.errors import BadInput
from touchline.core.json_values import JsonObject
from touchline.store.files import RecentFailures, write_atomically
from touchline.store.repository import content_etag


class SettingsRecord(Protocol):
    """Frozen; without arguments it is what runs where the file is damaged."""

    def __init__(self) -> None: ...
    def to_json(self) -> JsonObject: ...
    @classmethod
    def from_json(cls, value: Any) -> Self: ...


Config = TypeVar("Config", bound=SettingsRecord)


class SavedSettings(Generic[Config]):
    """The settings now, as `config`. Its caller locks.

    base: of the settings file. merged: entries that are mappings, of which a change names some; null removes one.
    is_damaged: the file cannot be read, and stays as it is until something is saved.
    """

    def __init__(
        self,
        path: Path,
        base: JsonObject,
        kind: type[Config],
        failures: RecentFailures,
        merged: Sequence[str] = (),
    ) -> None:
        self.path = path
        self._base, self._kind, self._failures, self._merged = base, kind, failures, merged
        self._changes: JsonObject = {}
        self.is_damaged = False
        try:
            self._changes = read_object(path)
            self.config = kind.from_json({**base, **self._changes})
        except (BadInput, ValueError, RecursionError, OSError):
            self._changes, self.config, self.is_damaged = {}, kind(), True

    @property
    def etag(self) -> str:
        return content_etag(self.config.to_json())

    def after(self, changes: JsonObject) -> tuple[JsonObject, Config]:
        """Return what save() takes, and the settings after the changes; BadInput."""
        saved: JsonObject = {**self._changes, **changes}
        for name in self._merged:
            if name in changes:
                merged = {**getattr(self.config, name), **saved[name]}
                saved[name] = {key: value for key, value in merged.items() if value is not None}
        return saved, self._kind.from_json({**self._base, **saved})

    def save(self, saved: JsonObject, config: Config) -> None:
        """Save what after() returned; from now on it counts."""
        with self._failures.noted("The setting"):
            self.path.parent.mkdir(exist_ok=True)
            write_atomically(self.path, json.dumps(saved, indent=1).encode())
        self._changes, self.config, self.is_damaged = saved, config, False


def read_object(path: Path) -> JsonObject:
    """Return the object in a JSON file, {} where there is none; ValueError for anything else."""
    if not path.exists():
        return {}
    value = json.loads(path.read_bytes())
    if not isinstance(value, dict):
        raise ValueError
    return value
