"""Fields as YAML files, one a file, named as the field is: those that come with Touchline, and the operator's own.

No file of the operator's own stops a start: one that cannot be read stays where it is, is not used, and is told.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Any

import yaml

from touchline.core.errors import BadInput, Conflict, NotFound, TouchlineError
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.records import Warning
from touchline.core.sentences import unknown_field, use_one_of
from touchline.core.statements import join, say
from touchline.installation import shipped
from touchline.store.files import (
    RecentFailures,
    make_folder,
    parse_yaml,
    read_yaml,
    sync_folder,
    write_atomically,
)
from touchline.store.repository import check_etag, content_etag

MAX_OWN_FIELDS = 500


def load_fields(folder: Path | None = None) -> dict[str, Field]:
    """Load every field of a folder by name, in order; without one, those that come with Touchline."""
    if folder is None:
        return dict(_shipped_fields())
    if not folder.is_dir():
        raise NotFound(
            f"The folder {folder.name!r} of fields does not exist.",
            "Enter an existing folder in the settings.",
            reason="no-fields",
        )
    fields = [load_field(path) for path in sorted(folder.glob("*.yaml"))]
    return {field.name: field for field in fields}


@cache
def _shipped_fields() -> dict[str, Field]:
    return load_fields(shipped("configs") / "fields")


def load_field(path: Path) -> Field:
    """Load the field of one file."""
    return _named_as(
        path, read_yaml(path, field_from_json, f"The field file {path.name}", "no-fields")
    )


def _named_as(path: Path, field: Field) -> Field:
    if field.name != path.stem:
        raise BadInput(
            f"The file {path.name} contains the field {field.name!r}.",
            f"Rename the file to {field.name}.yaml, or the field to {path.stem}.",
            reason="bad-field",
        )
    return field


def _file_of(path: Path, field: Field) -> bytes:
    """Return what a field's file is to hold; BadInput where that could not be read again."""
    data = yaml.dump(
        field.to_json(),
        Dumper=yaml.CSafeDumper,
        allow_unicode=True,
        sort_keys=False,
        encoding="utf-8",
        default_flow_style=None,
    )
    if _named_as(path, parse_yaml(data, field_from_json, path.name)).to_json() != field.to_json():
        raise BadInput(
            f"The file {path.name} would not hold this field as it is.",
            "Use plain letters in its title.",
            reason="bad-field",
        )
    return data


def field_etag(field: Field) -> str:
    return content_etag(field.to_json())


class FieldRepository(Mapping[str, Field]):
    """All fields by name; put() and delete() change the operator's own, which go before those of the same name.

    own: the folder of their YAML files; made when the first is written. revision: another one after every change.
    failures: where one that could not be saved is noted.
    """

    def __init__(self, own: Path, failures: RecentFailures | None = None) -> None:
        self._folder = own
        self._failures = failures or RecentFailures()
        self._lock = Lock()
        self._shipped = load_fields()
        self._own: dict[str, Field] = {}
        # by name: why a file of the own ones is not used
        self._unread: dict[str, TouchlineError] = {}
        for path in sorted(own.glob("*.yaml")):
            try:
                self._own[path.stem] = load_field(path)
            except TouchlineError as error:
                self._unread[path.stem] = error
        self.revision = self._revision()

    def __getitem__(self, name: str) -> Field:
        try:
            return self._own[name] if name in self._own else self._shipped[name]
        except (KeyError, TypeError):
            raise NotFound(unknown_field(name), use_one_of(self), reason="unknown-field") from None

    def __contains__(self, name: object) -> bool:
        return name in self._shipped or name in self._own

    def __iter__(self) -> Iterator[str]:
        return iter(self._shipped | self._own)

    def __len__(self) -> int:
        return len(self._shipped | self._own)

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should know: files that are not used, and own fields in the place of others."""
        unread = [
            Warning(
                "field-not-read",
                join(
                    say(
                        "field.not-read",
                        "The field file {file} is not used:",
                        file=f"{self._folder.name}/{name}.yaml",
                    ),
                    error.what,
                ),
                join(error.fix, say("field.not-read.fix", "Then restart Touchline.")),
            )
            for name, error in self._unread.items()
        ]
        replaced = [
            Warning(
                "field-replaced",
                say(
                    "field.replaced",
                    "Your field {name} replaces the field of the same "
                    "name that comes with Touchline.",
                    name=name,
                ),
                say("field.replaced.fix", "Save it under another name to use both."),
            )
            for name in self._own
            if name in self._shipped
        ]
        return (*unread, *replaced)

    def put(
        self,
        name: str,
        value: Any,
        etag: str | None = None,
        new: bool = False,
        check: Callable[[Field], None] = lambda field: None,
    ) -> Field:
        """Check and save a field; the one before stays until the new one is safe on disk.

        etag: of the field that it replaces; Stale if that is another one by now. None: whichever there is.
        new: Conflict where there is one of that name. check: raises for a field that is not to be saved.
        """
        self._refuse_shipped(name)
        field = field_from_json(value)
        if field.name != name:
            raise BadInput(
                f"The name in the field is {field.name!r}, not {name!r}.",
                "Use one name in both places.",
                reason="bad-field",
                entry="name",
            )
        with self._lock:
            if new and name in self._own:
                raise Conflict(
                    say("field.exists", "There is already a field called {name!r}.", name=name),
                    say(
                        "field.choose-another", "Choose another name, or change the existing field."
                    ),
                    reason="field-exists",
                    entry="name",
                )
            self._check_etag(name, etag)
            if name not in self._own and len(self._own) >= MAX_OWN_FIELDS:
                raise Conflict(
                    say(
                        "field.too-many",
                        "The maximum of {most} fields is reached.",
                        most=MAX_OWN_FIELDS,
                    ),
                    say("field.delete-one", "Delete a field that is no longer used."),
                    reason="too-many-fields",
                )
            check(field)
            path = self._folder / f"{name}.yaml"
            data = _file_of(path, field)
            with self._failures.noted("The field"):
                make_folder(self._folder)
                if name in self._unread and path.exists():  # it may be all that is left of a field
                    path.rename(
                        next(
                            kept
                            for number in count(1)
                            if not (kept := path.with_suffix(f".unread-{number}")).exists()
                        )
                    )
                write_atomically(path, data)
            self._unread.pop(name, None)
            self._replace_own({**self._own, name: field})
        return field

    def delete(self, name: str, etag: str | None = None) -> None:
        """Delete one of the operator's own with that ETag (None: whichever); NotFound, Conflict or Stale."""
        self._refuse_shipped(name)
        with self._lock:
            _ = self[name]
            self._check_etag(name, etag)
            with self._failures.noted("The deletion"):
                (self._folder / f"{name}.yaml").unlink(missing_ok=True)
                sync_folder(self._folder)
            self._replace_own({own: field for own, field in self._own.items() if own != name})

    def is_own(self, name: str) -> bool:
        """Tell whether an operator made it, and may change it."""
        return name in self._own

    def _replace_own(self, own: dict[str, Field]) -> None:
        self._own = own
        self.revision = self._revision()

    def _revision(self) -> str:
        return content_etag({name: field_etag(field) for name, field in self._own.items()})

    def _check_etag(self, name: str, etag: str | None) -> None:
        if etag is None:
            return
        known = self._own.get(name)
        if known is None:
            what = say(
                "stale.field-deleted", "Another user has deleted this field since you opened it."
            )
        else:
            what = say(
                "stale.field-changed", "Another user has changed this field since you opened it."
            )
        check_etag(
            etag,
            "" if known is None else field_etag(known),
            what,
            "stale-field",
            None if known is None else known.to_json(),
        )

    def _refuse_shipped(self, name: str) -> None:
        if name in self._shipped and name not in self._own:
            raise Conflict(
                say(
                    "field.built-in",
                    "The field {name} is built into Touchline and cannot be changed.",
                    name=name,
                ),
                say("field.another-name", "Choose another name for your field."),
                reason="shipped-field",
                entry="name",
            )
