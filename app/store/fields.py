"""The fields that are kept as YAML files, one field a file, named as the field is."""

from pathlib import Path

from app.core.errors import BadInput, NotFound
from app.core.field import Field
from app.core.field_json import field_from_json
from app.core.strict_yaml import MAX_BYTES, plain_from_yaml

_APP = Path(__file__).resolve().parent.parent
# An installed wheel carries configs/ inside the package; a checkout has it beside.
_PLACES = (_APP / "_configs" / "fields", _APP.parent / "configs" / "fields")


def fields_folder() -> Path:
    """Where the fields that come with Touchline are."""
    for place in _PLACES:
        if place.is_dir():
            return place
    raise NotFound("The fields that come with Touchline are not installed.",
                   "Install Touchline again, or name a folder of fields in the settings.", reason="no-fields")


def load_fields(folder: Path | None = None) -> dict[str, Field]:
    """Every field in the folder by name, in order; without one, those that come with Touchline."""
    folder = folder or fields_folder()
    if not folder.is_dir():
        raise NotFound(f"There is no folder {folder.name!r} of fields.", "Name an existing folder in the settings.",
                       reason="no-fields")
    fields = [load_field(path) for path in sorted(folder.glob("*.yaml"))]
    return {field.name: field for field in fields}


def load_field(path: Path) -> Field:
    """The field in one file."""
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise NotFound(f"The field file {path.name} cannot be read: {error.strerror}.",
                       "Check the file and who may read it.", reason="no-fields") from None
    try:
        field = field_from_json(plain_from_yaml(raw, f"The file {path.name}"))
    except BadInput as error:
        raise BadInput(f"{path.name}: {error.what}", error.fix, reason=error.reason) from None
    if field.name != path.stem:
        raise BadInput(f"The file {path.name} holds the field {field.name!r}.",
                       f"Call the file {field.name}.yaml, or the field {path.stem}.", reason="bad-field")
    return field
