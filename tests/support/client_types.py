"""The answers of touchline.Client as types, written from the REST description.

python -m tests.support.client_types      writes them anew
"""

import json
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.support.paths import PACKAGE
from touchline.main import create_app
from touchline.settings import Settings

FILE = PACKAGE / "client" / "answers.py"
WANTED = ("Snapshot", "Job", "Calibration")  # what the client's methods return
SCALARS = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}
HEAD = '''"""What the calls of the client answer. Written from the REST description by tests/support/client_types.py."""

from typing import Any, Literal, NotRequired, TypedDict
'''
Schema = Mapping[str, Any]


def client_types(description: Schema) -> str:
    """Return the module's text. description: the OpenAPI document."""
    schemas = description["components"]["schemas"]
    classes = [_class(name, schemas[name]) for name in _needed(schemas)]
    return "\n\n\n".join([HEAD.rstrip(), *classes]) + "\n"


def _needed(schemas: Schema) -> list[str]:
    """The wanted schemas after those that they name."""
    found: list[str] = []

    def add(name: str) -> None:
        for other in sorted(_references(schemas[name])):
            if other != name and other not in found:
                add(other)
        if name not in found:
            found.append(name)

    for name in WANTED:
        add(name)
    return found


def _references(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        if "$ref" in value:
            yield value["$ref"].rpartition("/")[2]
        for one in value.values():
            yield from _references(one)
    elif isinstance(value, list):
        for one in value:
            yield from _references(one)


def _class(name: str, schema: Schema) -> str:
    lines = [f"class {name}(TypedDict):"]
    if text := " ".join(schema.get("description", "").split()):
        whole = textwrap.fill(f'"""{text}', 114, initial_indent="    ", subsequent_indent="    ")
        lines += [*whole.splitlines()[:-1], f'{whole.splitlines()[-1]}"""', ""]
    required = set(schema.get("required", ()))
    for field, of in schema["properties"].items():
        kind = _kind(of)
        lines.append(f"    {field}: {kind if field in required else f'NotRequired[{kind}]'}")
    return "\n".join(lines)


def _kind(schema: Schema) -> str:
    if "$ref" in schema:
        return schema["$ref"].rpartition("/")[2]
    if "const" in schema:
        return f"Literal[{json.dumps(schema['const'])}]"
    if "enum" in schema:
        return f"Literal[{', '.join(json.dumps(value) for value in schema['enum'])}]"
    if "anyOf" in schema:
        return " | ".join(dict.fromkeys(_kind(one) for one in schema["anyOf"]))
    if schema.get("type") == "array":
        return f"list[{_kind(schema.get('items', {}))}]"
    if schema.get("type") == "object":
        return (
            f"dict[str, {_kind(schema.get('additionalProperties') or {})}]"
            if isinstance(schema.get("additionalProperties"), dict)
            else "dict[str, Any]"
        )
    return SCALARS.get(schema.get("type", ""), "Any")


def description_of(folder: Path) -> dict[str, Any]:
    """Return the OpenAPI document of the application. folder: an empty one, for its data."""
    app = create_app(Settings(data=folder))
    with app.state.services.store:
        return app.openapi()


if __name__ == "__main__":
    with TemporaryDirectory() as name:
        FILE.write_text(client_types(description_of(Path(name))))
