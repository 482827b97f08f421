"""All fields by name: those that come with Touchline, and the operator's own, which can be written."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

import yaml

from app.core.errors import BadInput, Conflict, NotFound
from app.core.field import Field
from app.core.field_json import field_from_json
from app.store.fields import load_fields
from app.store.files import keeping, make_folder, write_whole

MAX_OWN = 500


class FieldShelf(Mapping[str, Field]):
    """A mapping from a name to its Field; put() adds or changes one of the operator's own.

    own: the folder of their YAML files; made when the first is written.
    """

    def __init__(self, own: Path) -> None:
        self._folder = own
        self._lock = Lock()
        self._ours = load_fields()
        self._own = load_fields(own) if own.is_dir() else {}
        for name in self._own:
            self._refuse_ours(name)

    def __getitem__(self, name: str) -> Field:
        try:
            return self._ours[name] if name in self._ours else self._own[name]
        except (KeyError, TypeError):
            raise NotFound(f"There is no field called {name!r}.", f"Use one of: {', '.join(self)}.",
                           reason="unknown-field") from None

    def __contains__(self, name: object) -> bool:
        return name in self._ours or name in self._own

    def __iter__(self) -> Iterator[str]:
        return iter([*self._ours, *self._own])

    def __len__(self) -> int:
        return len(self._ours) + len(self._own)

    def put(self, name: str, value: Any) -> Field:
        """Check and keep a field; what stood there before stays until the new one is safe on disk."""
        self._refuse_ours(name)
        field = field_from_json(value)
        if field.name != name:
            raise BadInput(f"The field calls itself {field.name!r}, not {name!r}.", "Use one name in both places.",
                           reason="bad-field")
        with self._lock:
            if name not in self._own and len(self._own) >= MAX_OWN:
                raise Conflict(f"There are {MAX_OWN} fields already.", "Change one of them.", reason="too-many-fields")
            text = yaml.safe_dump(field.to_json(), allow_unicode=True, sort_keys=False)
            with keeping("The field"):
                write_whole(make_folder(self._folder) / f"{name}.yaml", text.encode())
            self._own = {**self._own, name: field}
        return field

    def _refuse_ours(self, name: str) -> None:
        if name in self._ours:
            raise Conflict(f"The field {name} comes with Touchline and stays as it is.",
                           "Give yours a name of its own.", reason="shipped-field")
