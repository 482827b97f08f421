"""Field definitions as YAML files, one field a file, named as the field is."""

from pathlib import Path

from app import shipped
from app.core.errors import BadInput, NotFound
from app.core.field import Field
from app.core.field_json import field_from_json
from app.store.files import read_yaml


def fields_folder() -> Path:
    """Return the folder of the fields that come with Touchline."""
    return shipped("configs") / "fields"


def load_fields(folder: Path | None = None) -> dict[str, Field]:
    """Load every field of a folder by name, in order; without one, those that come with Touchline."""
    folder = folder or fields_folder()
    if not folder.is_dir():
        raise NotFound(f"There is no folder {folder.name!r} of fields.", "Name an existing folder in the settings.",
                       reason="no-fields")
    fields = [load_field(path) for path in sorted(folder.glob("*.yaml"))]
    return {field.name: field for field in fields}


def load_field(path: Path) -> Field:
    """Load the field of one file."""
    field = read_yaml(path, field_from_json, f"The field file {path.name}", "no-fields")
    if field.name != path.stem:
        raise BadInput(f"The file {path.name} holds the field {field.name!r}.",
                       f"Call the file {field.name}.yaml, or the field {path.stem}.", reason="bad-field")
    return field
