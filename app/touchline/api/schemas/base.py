"""How responses are described for the documentation: from a record, or as a table of names and types.

Routes send their JSON as it is; tests hold it to these descriptions.
"""

from collections.abc import Collection
from types import GenericAlias
from typing import Annotated, Any, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model

from touchline.core.json_values import JsonObject


class Texts(BaseModel):
    """An object of texts, and what its sentences state beside them."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]
    statements: JsonObject = Field(default_factory=dict)


class Answer(BaseModel):
    """A JSON object to which entries may be added; none is ever renamed."""

    model_config = ConfigDict(extra="allow")


def response(name: str, base: type[Answer] = Answer, /, *, record: type | None = None,
             without: Collection[str] = (), says: bool = False, **types: Any) -> type[Answer]:
    """Describe a response: the fields of its record, a dataclass, and others by name and type; all required.

    says: whether it has sentences of its own, and so `statements` where they are known.
    """
    fields = {**(get_type_hints(record) if record is not None else {}), **types}
    described: dict[str, Any] = {field: (type, ...) for field, type in fields.items() if field not in without}
    if says:
        described["statements"] = (JsonObject, Field(default_factory=dict))
    return create_model(name, __base__=base, **described)


def described(type: Any, description: str) -> Any:
    """Return the type of a field with its description."""
    return Annotated[type, Field(description=description)]


def list_of(item: type) -> GenericAlias:
    """Return list[item], which a type checker reads only of classes that are written out."""
    return GenericAlias(list, (item,))


def page_of(name: str, item: type) -> type[Answer]:
    """Describe a page: items, newest first, and the cursor of those after them, null at the end."""
    return response(name, items=list_of(item), next_cursor=str | None)
