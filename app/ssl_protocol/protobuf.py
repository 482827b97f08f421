"""Protocol Buffers, version 2, for records whose fields say how they travel.

    @dataclass(frozen=True)
    class Spot:
        x: float = required(1, "float")
        name: str | None = optional(2, "string")
        parts: tuple[Spot, ...] = repeated(3, Spot)

A tag is a varint of number · 8 + wire type: 0 varint, 1 eight bytes, 2 a length and so many bytes, 5 four bytes (see
Google's "Encoding" page). Reading is strict: limits before anything is built, floats finite, text UTF-8, what is
required there; fields that we do not know are passed over, as the format has it, and later values win.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import MISSING, field, fields
from typing import TYPE_CHECKING, Any, TypeVar

from app.core.errors import BadInput

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Message = TypeVar("Message", bound="DataclassInstance")

MAX_BYTES = 65_507  # what one UDP datagram carries
MAX_REPEATED = 1000  # of one field; the richest league field has 60 lines
VARINT, EIGHT, LENGTH, FOUR = 0, 1, 2, 5
WIRE_TYPES = {"float": FOUR, "double": EIGHT, "int32": VARINT, "uint32": VARINT, "enum": VARINT, "string": LENGTH}
FLOATS = {"float": "<f", "double": "<d"}


def required(number: int, kind: Any) -> Any:
    return field(metadata={"number": number, "kind": kind, "label": "required"})


def optional(number: int, kind: Any) -> Any:
    return field(default=None, metadata={"number": number, "kind": kind, "label": "optional"})


def repeated(number: int, kind: Any) -> Any:
    return field(default=(), metadata={"number": number, "kind": kind, "label": "repeated"})


def encode(message: Any) -> bytes:
    """The message's bytes, fields in the order of their numbers."""
    parts = []
    for f in sorted(fields(message), key=lambda f: f.metadata["number"]):
        value = getattr(message, f.name)
        values = value if f.metadata["label"] == "repeated" else () if value is None else (value,)
        tag = _number(f.metadata["number"] << 3 | _wire_type(f.metadata["kind"]))
        parts += [tag + _value(f.metadata["kind"], v, f.name) for v in values]
    return b"".join(parts)


def decode(kind: type[Message], data: bytes) -> Message:
    """The message in the bytes; BadInput where they are none of that kind."""
    if len(data) > MAX_BYTES:
        raise BadInput(f"The message has {len(data)} bytes. The limit for a datagram is {MAX_BYTES}.",
                       "Send a single packet.", reason="bad-protobuf")
    return _message(kind, memoryview(data))


def _message(kind: type[Message], data: memoryview) -> Message:
    known = {f.metadata["number"]: f for f in fields(kind)}
    found: dict[str, Any] = {}
    for number, wire_type, value in _walk(data):
        f = known.get(number)
        if f is None:
            continue
        f_kind, label = f.metadata["kind"], f.metadata["label"]
        if wire_type != _wire_type(f_kind):
            raise _refuse(f"{kind.__name__}.{f.name} has another type")
        read = _read(f_kind, value, f.name)
        if label == "repeated":
            found.setdefault(f.name, []).append(read)
            if len(found[f.name]) > MAX_REPEATED:
                raise _refuse(f"{kind.__name__}.{f.name} occurs more than {MAX_REPEATED} times")
        else:
            found[f.name] = read
    for f in fields(kind):
        if f.default is MISSING and f.name not in found:
            raise _refuse(f"{kind.__name__} has no {f.name}")
    return kind(**{name: tuple(v) if isinstance(v, list) else v for name, v in found.items()})


def _walk(data: memoryview) -> Iterator[tuple[int, int, int | memoryview]]:
    """(field number, wire type, value) one after another."""
    at = 0
    value: int | memoryview
    while at < len(data):
        tag, at = _varint(data, at)
        number, wire_type = tag >> 3, tag & 7
        if not 1 <= number < 1 << 29:
            raise _refuse(f"a field has the number {number}")
        if wire_type == VARINT:
            value, at = _varint(data, at)
        elif wire_type in (EIGHT, FOUR, LENGTH):
            length = {EIGHT: 8, FOUR: 4}.get(wire_type)
            if length is None:
                length, at = _varint(data, at)
            if length > len(data) - at:
                raise _refuse("it ends within a field")
            value, at = data[at:at + length], at + length
        else:
            raise _refuse(f"a field has the wire type {wire_type}")
        yield number, wire_type, value


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """An unsigned number of at most 64 bits, seven a byte, the lowest first; and where it ends."""
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise _refuse("it ends within a number")
        byte, at = data[at], at + 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & (1 << 64) - 1, at
    raise _refuse("a number is longer than 64 bits")


def _read(kind: Any, value: Any, name: str) -> Any:
    if not isinstance(kind, str):
        return _message(kind, value)
    if kind in FLOATS:
        (number,) = struct.unpack(FLOATS[kind], value)
        if not math.isfinite(number):
            raise _refuse(f"{name} is not finite")
        return number
    if kind == "string":
        try:
            return bytes(value).decode()
        except UnicodeDecodeError:
            raise _refuse(f"{name} is not text") from None
    if kind == "uint32":
        return value & 0xFFFFFFFF
    return ((value & 0xFFFFFFFF) ^ 0x80000000) - 0x80000000  # int32 and enum: the low 32 bits, signed


def _value(kind: Any, value: Any, name: str) -> bytes:
    if not isinstance(kind, str):
        inner = encode(value)
        return _number(len(inner)) + inner
    if kind in FLOATS:
        try:
            packed = struct.pack(FLOATS[kind], value)
        except (OverflowError, struct.error):
            packed = None
        if packed is None or not math.isfinite(value):
            raise BadInput(f"{name} cannot be sent as {kind}: {value!r}.", "Correct it.", reason="bad-protobuf")
        return packed
    if kind == "string":
        text = value.encode()
        return _number(len(text)) + text
    low, high = (0, 2**32) if kind == "uint32" else (-(2**31), 2**31)
    if value != int(value) or not low <= value < high:
        raise BadInput(f"{name} cannot be sent as {kind}: {value!r}.", "Correct it.", reason="bad-protobuf")
    return _number(int(value) % (1 << 64))  # a negative int32 takes ten bytes


def _wire_type(kind: Any) -> int:
    return WIRE_TYPES[kind] if isinstance(kind, str) else LENGTH


def _number(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def _refuse(what: str) -> BadInput:
    return BadInput(f"This message is not valid: {what}.", "Send a packet in the format of the league's software.",
                    reason="bad-protobuf")
