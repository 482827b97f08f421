"""Reads plain data, as JSON and YAML have it, into a type: strictly, and what is refused is named by its place.

    class Sample(TypedDict):
        rgb: tuple[Level, Level, Level]
        spread: NotRequired[Annotated[float, Interval(ge=0, le=1)]]

    sample = read(Sample, value, "The sample", "Give a sample that a profile holds.", "bad-colours")

Strictly: "3" and true are no numbers, NaN and infinity are neither, and an entry that the type does not have is an
error. The type is a TypedDict or a dataclass; its limits are those of annotated_types.
"""

from types import GenericAlias
from typing import TYPE_CHECKING, Any, TypeVar

from touchline.core.errors import BadInput

if TYPE_CHECKING:
    from pydantic import TypeAdapter

T = TypeVar("T")
# What pydantic finds, in words; {…} is the limit that it states.
FAULTS = {
    "missing": "is missing", "extra_forbidden": "is unknown", "unexpected_keyword_argument": "is unknown",
    "float_type": "is not a number", "finite_number": "is not a number", "int_type": "is not a whole number",
    "string_type": "is not a text", "bool_type": "is neither true nor false", "literal_error": "is not {expected}",
    "list_type": "is not a list", "tuple_type": "is not a list", "dict_type": "is not an object",
    "dataclass_type": "is not an object", "model_type": "is not an object",
    "greater_than_equal": "is less than {ge:g}", "less_than_equal": "is more than {le:g}",
    "too_short": "has fewer than {min_length} entries", "too_long": "has more than {max_length} entries",
    "string_too_short": "is too short", "string_too_long": "has more than {max_length} characters"}
MAX_PLACE = 100  # characters
_adapters: "dict[type, TypeAdapter[Any]]" = {}  # made once: it takes a millisecond


class Whole:
    """Among a type's limits: a whole number may be written with a point, as 9.0."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(
            lambda value: int(value) if isinstance(value, float) and value.is_integer() else value, handler(source))


def read(kind: type[T], value: Any, what: str, fix: str, reason: str) -> T:
    """Read value as that type. what: how an error calls it, such as "The board"; fix, reason: of the BadInput."""
    from pydantic import ConfigDict, TypeAdapter, ValidationError
    from pydantic_core import to_json

    if kind not in _adapters:
        one: Any = GenericAlias(list, (kind,))  # a list hands its configuration on to all that is within
        _adapters[kind] = TypeAdapter(one, config=ConfigDict(strict=True, extra="forbid", allow_inf_nan=False))
    try:  # as JSON, whose lists and objects are tuples and dataclasses as well; NaN becomes a text, so no number
        found: T = _adapters[kind].validate_json(to_json([value], inf_nan_mode="strings"))[0]
        return found
    except ValidationError as refused:
        error = refused.errors(include_url=False, include_input=False)[0]
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error["loc"][1:])[1:MAX_PLACE]
        fault = FAULTS.get(error["type"], "is not valid").format(**error.get("ctx", {}))
        raise BadInput(f"{what}: {place} {fault}." if place else f"{what} {fault}.", fix, reason=reason) from None
    except ValueError:  # half a character, or a nesting without an end
        raise BadInput(f"{what} has an entry that JSON cannot hold.", fix, reason=reason) from None
