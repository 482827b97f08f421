"""Fields as the API and files show them, and the calibrations that a change of one has made wrong."""

import json
from collections.abc import Iterable

from touchline.core.field import Field, FieldJson
from touchline.core.field_json import field_from_json, refuse
from touchline.core.records import Calibration
from touchline.core.statements import named, stated
from touchline.formats import ssl_vision
from touchline.formats.numbers import format_error
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.services.container import Services
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryData, SSL_Source, SSL_WrapperPacket

FIX = "Use a field exported as JSON, or a geometry packet of the league."


def write_field(field: Field, format: str) -> tuple[bytes, str, str]:
    """Return (bytes, media type, suffix) in the format "json" or "ssl-vision"; that has whole mm and no landmarks."""
    if format == "json":
        text = json.dumps(field.to_json(), indent=1, allow_nan=False, ensure_ascii=False)
        return text.encode(), "application/json", ".json"
    packet = SSL_WrapperPacket(
        geometry=SSL_GeometryData(field=field_to_wire(field)), source=SSL_Source.OTHER
    )
    return encode(packet), ssl_vision.FORMAT.media_type, ssl_vision.FORMAT.suffix


def parsed_field(data: bytes, known: Iterable[Field] = ()) -> Field:
    """Return the field that write_field wrote, or any geometry packet; BadInput for anything else.

    known: a packet with just their lines is one of these, with its landmarks and regions.
    """
    if ssl_vision.recognises(data):
        packet = decode(SSL_WrapperPacket, data)
        if not packet.HasField("geometry"):
            raise format_error("The packet contains no field.", FIX)
        return field_from_wire(packet.geometry.field, known)
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        raise refuse("The file is not a field.", FIX) from None
    return field_from_json(value)


class PlayingField(FieldJson):
    """A field as the API shows it. own: whether an operator made it, and may change it."""

    own: bool


def field_json(services: Services, field: Field) -> PlayingField:
    own = services.fields.is_own(field.name)
    is_shipped = (
        not own
        and field.name in services.fields
        and field.title == services.fields[field.name].title
    )
    title = named(f"field.{field.name}", field.title) if is_shipped else field.title
    shown: PlayingField = {**field.to_json(), "title": title, "own": own}
    return stated(shown)


def outdated_calibrations(services: Services, field: Field) -> list[Calibration]:
    """List the active calibrations that the field's changes have made wrong."""
    now = field.to_json()
    return [
        calibration
        for calibration in services.cameras.active_calibrations()
        if calibration.field["name"] == field.name and calibration.field_changes(now)
    ]
