"""vision-processor's geometry.yml: what its publisher sends each second, the field with its ball models and cameras.

It is the league's geometry message as YAML, in the message's own names, but for optional_field_lines: which markings
the publisher makes of the dimensions. The borders it always makes.
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import yaml
from google.protobuf.json_format import MessageToDict, ParseDict, ParseError
from google.protobuf.message import Message

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.formats import Format
from touchline.formats.approximation import ExportCamera, header, metadata_from_comment
from touchline.formats.camera_file import CameraFile
from touchline.formats.document import FileContent, parse
from touchline.formats.league_file import LeagueFile, Markings
from touchline.formats.numbers import MAX_DIGITS, NUMBER, format_error, require
from touchline.formats.ssl_field import field_to_wire, markings_alone
from touchline.formats.ssl_vision import camera_from_wire, camera_number, camera_to_wire
from touchline.models import Restored
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_GeometryCameraCalibration,
    SSL_GeometryData,
    SSL_GeometryFieldSize,
    SSL_GeometryModels,
)

GEOMETRY = re.compile(rb"^(?:field|optional_field_lines)\s*:\s*(?:#.*)?\r?$", re.MULTILINE)
# the file's names of what its publisher draws, and ours in Markings; the older one called the whole default_lines
OPTIONAL = {
    "goal2goal": "goal_to_goal",
    "halfway": "halfway",
    "centercircle": "centre_circle",
    "penalty": "penalty",
}
BORDERS = {"TopTouchLine", "BottomTouchLine", "LeftGoalLine", "RightGoalLine"}
OF_OPTIONAL = ("optional_field_lines", "default_lines")
NETWORK = ("vision_ip", "vision_port")  # where it sends, which is not of the field
NAME, TITLE = "vision-processor", "vision-processor geometry"
ALWAYS = ("line_thickness", "penalty_area_depth", "penalty_area_width", "center_circle_radius")
# what the file must have or usually has, for a field that has none
OTHERWISE = {
    "line_thickness": 10,
    **dict.fromkeys(ALWAYS[1:], 0),
    "goal_center_to_penalty_mark": 0,
    "ball_radius": 21.5,
    "max_robot_radius": 90.0,
    "goal_substitution_area_width": 0,
}
TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


def league_file(document: FileContent) -> LeagueFile | None:
    """Return what a geometry.yml holds; None for another file, BadInput where it is wrong."""
    content = document.first
    field = content.get("field")
    if not isinstance(field, dict) or "field_length" not in field:
        return None
    for name in ALWAYS:
        require(field, name, "field")
    markings = _markings(content)
    stated = {k: v for k, v in content.items() if k not in (*OF_OPTIONAL, *NETWORK)}
    sent = SSL_GeometryData()
    try:
        ParseDict(_typed(stated), sent)
        _add(sent.field, markings)
        sent = decode(SSL_GeometryData, encode(sent))  # which checks it
    except (ParseError, BadInput) as error:
        raise format_error(
            f"The file is not a geometry of vision-processor: {str(error)[:160]}.", "Correct it."
        ) from None
    cameras = {str(one.camera_id): partial(_camera, one) for one in sent.calib}
    models = (lambda: sent.models) if sent.HasField("models") else None
    return LeagueFile(NAME, TITLE, sent.field, cameras, models)


def read(data: bytes, entry: str | None = None) -> CameraFile:
    """Read the camera with this number, or the only one."""
    found = league_file(parse(data))
    if found is None:
        raise format_error("The file has no field.", "Use a geometry.yml of vision-processor.")
    return replace(found.camera(entry), metadata=metadata_from_comment(data))


def recognises(data: bytes) -> bool:
    return b"field_length" in data and GEOMETRY.search(data) is not None


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    _, field, region = Restored.of(calibration)
    number = camera_number(field, region) if export.camera_id is None else export.camera_id
    about = header(calibration, export, pose=False)
    return (about + geometry(field, [camera_to_wire(export.camera, number)])).encode()


def geometry(
    field: Field,
    cameras: Iterable[SSL_GeometryCameraCalibration] = (),
    models: SSL_GeometryModels | None = None,
) -> str:
    """Return a geometry.yml; Conflict for a field whose borders are not where vision-processor makes them.

    It makes them of a field without painted borders as well.
    """
    sent = field_to_wire(field)
    for name, otherwise in OTHERWISE.items():
        if not sent.HasField(name):
            setattr(sent, name, otherwise)
    optional = {name: _has(sent, member) for name, member in OPTIONAL.items()}
    made, own = _bare(sent), _bare(sent)
    _add(made, Markings(**{member: optional[name] for name, member in OPTIONAL.items()}))
    called = {line.name for line in sent.field_lines}
    if elsewhere := [name for name in markings_alone(made, sent) if name in called]:
        raise Conflict(
            f"vision-processor makes {', '.join(elsewhere)} of length and width, this field has it elsewhere.",
            "Export the field as ssl-vision, and send it with Touchline.",
            reason="format-cannot-hold",
        )
    alone = markings_alone(sent, made)
    own.field_lines.extend(line for line in sent.field_lines if line.name in alone)
    own.field_arcs.extend(arc for arc in sent.field_arcs if arc.name in alone)
    content: JsonObject = {"optional_field_lines": optional, "field": _plain(own)}
    if models is not None:
        content["models"] = _plain(models)
    if calib := [_plain(one) for one in cameras]:
        content["calib"] = calib
    return yaml.safe_dump(content, sort_keys=False)


def _has(sent: SSL_GeometryFieldSize, member: str) -> bool:
    """Whether the field has all that the publisher makes for this entry."""
    made = _bare(sent)
    _add(made, Markings(**{name: name == member for name in OPTIONAL.values()}))
    return set(markings_alone(made, sent)) <= BORDERS


def _bare(sent: SSL_GeometryFieldSize) -> SSL_GeometryFieldSize:
    """Return a field's dimensions without its markings."""
    bare = SSL_GeometryFieldSize()
    bare.CopyFrom(sent)
    del bare.field_lines[:], bare.field_arcs[:]
    return bare


def _add(sent: SSL_GeometryFieldSize, markings: Markings) -> None:
    sent.field_lines.extend(markings.lines(sent))
    sent.field_arcs.extend(markings.arcs(sent, sent.line_thickness))


def _camera(sent: SSL_GeometryCameraCalibration, field: Field) -> CameraFile:
    return replace(camera_from_wire(sent, field), program=NAME)


def _plain(message: Message) -> JsonObject:
    return MessageToDict(message, preserving_proto_field_name=True)


def _markings(content: JsonObject) -> Markings:
    """Return which markings the publisher makes: all that are not ruled out."""
    for key in OF_OPTIONAL:
        given = content.get(key)
        if not isinstance(given, dict):
            continue
        for name, stated in given.items():
            if name not in OPTIONAL or str(stated).lower() not in TRUTHS:
                raise format_error(
                    f"{key}.{str(name)[:40]} is {str(stated)[:40]!r}.",
                    f"Use {', '.join(OPTIONAL)} with true or false.",
                )
        return Markings(**{OPTIONAL[k]: TRUTHS[str(v).lower()] for k, v in given.items()})
    return Markings()


def _typed(value: Any) -> Any:
    """Return a document's texts as YAML has them for the message: numbers where they are such."""
    if isinstance(value, dict):
        return {key: _typed(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_typed(part) for part in value]
    if isinstance(value, str) and len(value) <= MAX_DIGITS and NUMBER.fullmatch(value):
        return float(value) if set(value) & set(".eE") else int(value)
    return value


FORMAT = Format(
    "vision-processor geometry",
    "application/yaml",
    ".geometry.yml",
    "The league's one-term lens, with the pose and the field, for vision-processor's publisher.",
    write,
    read,
    recognises,
    lenses={"ssl": ("a",)},
    square_pixels=True,
)
