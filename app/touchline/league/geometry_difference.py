"""What another publisher's geometry has otherwise than ours, in sentences: the field, its markings, the ball models."""

from touchline.core.statements import Sentence, say
from touchline.formats.ssl_known_field import markings_alone
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryData, SSL_GeometryFieldSize

MARKINGS = ("field_lines", "field_arcs")  # compared by their places
SIZE = ("field_length", "field_width")
SAME = 1e-3  # of a float of four bytes
NAMED = 4  # of what differs; the rest is counted


def geometry_differences(theirs: SSL_GeometryData, ours: SSL_GeometryData) -> list[Sentence]:
    """Say what differs for a program that hears both; nothing where it takes them for one field."""
    size = [(getattr(one.field, SIZE[0]), getattr(one.field, SIZE[1])) for one in (theirs, ours)]
    if size[0] != size[1]:
        return [say("receiving.differs.size", "It sends a field of {length} × {width} mm; you send {our_length} × "
                    "{our_width} mm.", length=size[0][0], width=size[0][1], our_length=size[1][0],
                    our_width=size[1][1])]
    found = []
    for names, words in ((markings_alone(theirs.field, ours.field), say(
            "receiving.differs.theirs", "Only it sends these markings, or at this place:")), (
            markings_alone(ours.field, theirs.field), say(
            "receiving.differs.ours", "Only you send these markings, or at this place:"))):
        if names:
            found.append(say("receiving.differs.markings", "{words} {names}.", words=words, names=_few(names)))
    if values := _values(theirs.field, ours.field):
        found.append(say("receiving.differs.values", "Sizes differ (there, here): {values}.", values=_few(values)))
    if theirs.models != ours.models:
        found.append(say("receiving.differs.models", "It sends other ball models than you."))
    return found


def _values(theirs: SSL_GeometryFieldSize, ours: SSL_GeometryFieldSize) -> list[str]:
    """List the fields whose numbers differ, by their names on the wire, with both."""
    found = []
    for field in theirs.DESCRIPTOR.fields:
        if field.name not in MARKINGS:
            a, b = (getattr(one, field.name) if one.HasField(field.name) else None for one in (theirs, ours))
            if a != b and not (a is not None and b is not None and abs(a - b) <= SAME):
                found.append(f"{field.name} {_number(a)}, {_number(b)}")
    return found


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:g}"


def _few(names: list[str]) -> list[str]:
    return names if len(names) <= NAMED else [*names[:NAMED], f"… ({len(names)})"]
