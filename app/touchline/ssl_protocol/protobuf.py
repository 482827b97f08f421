"""Build, encode and decode Protocol Buffers strictly, whatever a stranger sends.

Google's reader sees to the format; limits, finite floats, text and what is required are checked here, before anybody
uses a message.
"""

import math
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

from google.protobuf.message import DecodeError, Message

from touchline.core.errors import BadInput

Fields = ParamSpec("Fields")
Built = TypeVar("Built", bound=Message)

MAX_BYTES = 65_507  # what one UDP datagram carries
MAX_REPEATED = 1000  # of one field; the richest league field has 60 lines


def build(kind: Callable[Fields, Built], *args: Fields.args, **values: Fields.kwargs) -> Built:
    """Build a message; BadInput where a value does not fit its field."""
    try:
        return kind(*args, **values)
    except (TypeError, ValueError):
        for name, value in values.items():
            if not _fits(kind, name, value):
                raise BadInput(
                    f"{name} cannot be sent: {value!r}.", "Correct it.", reason="bad-protobuf"
                ) from None
        raise


def encode(message: Message) -> bytes:
    """Return the message's bytes, fields in the order of their numbers; BadInput where it is not whole."""
    if (problem := _problem(message)) is not None:
        raise BadInput(
            f"This message cannot be sent: {problem}.", "Correct it.", reason="bad-protobuf"
        )
    return message.SerializeToString()


def decode(kind: type[Built], data: bytes) -> Built:
    """Return the message in the bytes; BadInput where they are none of that kind."""
    if len(data) > MAX_BYTES:
        raise BadInput(
            f"The message has {len(data)} bytes. The limit for a datagram is {MAX_BYTES}.",
            "Send a single packet.",
            reason="bad-protobuf",
        )
    message = kind()
    try:
        message.ParseFromString(data)
        problem = _problem(message)
    except DecodeError:
        problem = "it ends within a field, or a field is damaged"
    if problem is not None:
        raise BadInput(
            f"This message is not valid: {problem}.",
            "Send a packet in the format of the league's software.",
            reason="bad-protobuf",
        )
    return message


def _fits(kind: Callable[..., object], name: str, value: object) -> bool:
    try:
        kind(**{name: value})
    except (TypeError, ValueError):
        return False
    return True


def _problem(message: Message) -> str | None:
    """Say the first thing that is wrong within a message."""
    parts: Sequence[Message]
    for field, value in message.ListFields():
        match value:
            case float() if not math.isfinite(value):
                return f"{field.name} is not finite"
            case _ if field.type == field.TYPE_BYTES:
                continue
            case bytes():  # of a text that is not UTF-8
                return f"{field.name} is not text"
            case float() | int() | str():
                continue
            case Message():
                parts = (value,)
            case _:
                parts = value
        if len(parts) > MAX_REPEATED:
            return f"{message.DESCRIPTOR.name}.{field.name} occurs more than {MAX_REPEATED} times"
        for part in parts:
            if (problem := _problem(part)) is not None:
                return problem
    if not message.IsInitialized():  # its parts are, or they would have been named
        missing = next(
            f.name
            for f in message.DESCRIPTOR.fields
            if f.is_required and not message.HasField(f.name)
        )
        return f"{message.DESCRIPTOR.name} has no {missing}"
    return None
