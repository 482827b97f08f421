"""ssl-vision's settings, robocup-ssl.xml: the field, and each camera's calibration, of either of its two models.

Elements are called by their attribute: Global / Field Configuration, and in each Thread N a Camera Calibrator. Numbers
have six decimals, with the decimal sign of the country of the machine that wrote them. A field without lines is one
of which ssl-vision makes them itself.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Field
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.formats.camera_file import CameraFile, lens_from_terms, pose_from_field
from touchline.formats.document import FileContent
from touchline.formats.league_file import LeagueFile, Markings
from touchline.formats.numbers import DECIMAL_COMMA, NUMBER, checked_size, number, require
from touchline.formats.program_forms import PROGRAMS
from touchline.formats.ssl_vision import pose_from_quaternion
from touchline.models.lenses.brown_conrady import TERMS
from touchline.ssl_protocol.protobuf import build
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_FieldCircularArc,
    SSL_FieldLineSegment,
    SSL_FieldShapeType,
    SSL_GeometryFieldSize,
    SSL_GeometryModels,
    Vector2f,
)

FILE = "ssl-vision-settings"
ROOT = "VarXML"
MAX_CAMERAS = 8
# the message's names: the settings' and, of those that older programs lack, what counts without them
DIMENSIONS: dict[str, tuple[str, int | None]] = {
    "field_length": ("Field Length", None),
    "field_width": ("Field Width", None),
    "goal_width": ("Goal Width", None),
    "goal_depth": ("Goal Depth", None),
    "goal_height": ("Goal Height", 155),
    "line_thickness": ("Line Thickness", 10),
    "penalty_area_depth": ("Penalty Area Depth", None),
    "penalty_area_width": ("Penalty Area Width", None),
    "center_circle_radius": ("Center Circle Radius", None),
}
OTHER_DIMENSIONS = {  # that a field need not have
    "goal_center_to_penalty_mark": "Goal Line to Penalty Mark",
    "ball_radius": "Ball Radius",
    "max_robot_radius": "Max Robot Radius",
    "goal_substitution_area_width": "Goal Substitution Area Width",
}
BOUNDARIES = ("Boundary Width Touch Line", "Boundary Width")
GOAL_BOUNDARY = "Boundary Width Goal Line"
SHAPES = frozenset(SSL_FieldShapeType.keys())
SSL_NUMBERS = (
    *("focal length", "principal point x", "principal point y", "distortion"),
    *("q0", "q1", "q2", "q3", "tx", "ty", "tz"),
)
# of the ball, by the message's names
STRAIGHT = {
    "acc_slide": "Sliding acceleration [m/s^2]",
    "acc_roll": "Rolling acceleration [m/s^2]",
    "k_switch": "Switch factor",
}
CHIP = {
    "damping_xy_first_hop": "Damping (xy) on first hop",
    "damping_xy_other_hops": "Damping (xy) on other hops",
    "damping_z": "Damping (z)",
}
USES_OPENCV = "use openCV camera model"
BEGINS = {
    "q0": 0.7,
    "q1": -0.7,
    "q2": 0.0,
    "q3": 0.0,
}  # where ssl-vision's search for a pose begins


def recognises(data: bytes) -> bool:
    return b"<VarXML" in data[:1024]


def league_file(document: FileContent) -> LeagueFile | None:
    """Return what the settings hold; None for another file, BadInput where they have no field."""
    if ROOT not in document.first:
        return None
    settings = document.first[ROOT]
    known = settings.get("Global") if isinstance(settings, dict) else None
    if not isinstance(known, dict) or not isinstance(known.get("Field Configuration"), dict):
        raise BadInput(
            "The file contains settings of ssl-vision, but no field.",
            "Use the file robocup-ssl.xml of ssl-vision.",
            reason="unknown-file",
        )
    cameras: dict[str, Callable[[Field], CameraFile]] = {}
    for i in range(MAX_CAMERAS):
        thread = settings.get(f"Thread {i}")
        calibrator = thread.get("Camera Calibrator") if isinstance(thread, dict) else None
        if isinstance(calibrator, dict) and _is_calibrated(calibrator.get("Camera Parameters")):
            at = f"Thread {i}, Camera Calibrator"
            about = calibrator.get("Calibration Parameters") or {}
            name = str(about.get("camera index", i)) if isinstance(about, dict) else str(i)
            cameras.setdefault(name[:10], partial(_camera, calibrator, at))
    field = known["Field Configuration"]
    models = partial(_ball_models, field["Models"]) if "Models" in field else None
    return LeagueFile(FILE, PROGRAMS[FILE][0], _field(field), cameras, models)


def _is_calibrated(parameters: Any) -> bool:
    """Whether a camera has a pose other than the one that it begins with, or none: ssl-vision lists four or more."""
    if not isinstance(parameters, dict):
        return False
    if parameters.get(USES_OPENCV) == "true":
        return True
    begins = (str(parameters.get(name, "0")).replace(",", ".") for name in BEGINS)
    return [*map(_rounded, begins)] not in ([*BEGINS.values()], [0.0] * len(BEGINS))


def _rounded(text: str) -> float | None:
    return round(float(text), 6) if NUMBER.fullmatch(text) else None


def _number(settings: Any, name: str, at: str) -> float:
    """Return one number of the settings, whichever decimal sign it has."""
    value = require(settings, name, at)
    if isinstance(value, str) and DECIMAL_COMMA.fullmatch(value):
        value = value.replace(",", ".")
    return number(value, f"{at}, {name}")


def _field(settings: JsonObject) -> SSL_GeometryFieldSize:
    at = "Field Configuration"
    values: JsonObject = {}
    for name, (called, otherwise) in DIMENSIONS.items():
        if otherwise is None or called in settings:
            values[name] = int(_number(settings, called, at))
        else:
            values[name] = otherwise
    touch = next((name for name in BOUNDARIES if name in settings), BOUNDARIES[0])
    values["boundary_width"] = int(_number(settings, touch, at))
    goal = GOAL_BOUNDARY if GOAL_BOUNDARY in settings else touch
    values["boundary_width_goal_line"] = int(_number(settings, goal, at))
    for name, called in OTHER_DIMENSIONS.items():
        if called in settings:
            value = _number(settings, called, at)
            values[name] = value if name.endswith("radius") else int(value)
    sent = build(SSL_GeometryFieldSize, **values)
    lines, arcs = (_listed(settings, name) for name in ("Field Lines", "Field Arcs"))
    if not lines and not arcs:
        markings = Markings(goal_to_goal=settings.get("Center Line", "true") == "true")
        sent.field_lines.extend(markings.lines(sent))
        sent.field_arcs.extend(markings.arcs(sent, 10))
    sent.field_lines.extend(_line(line, f"{at}, Field Lines, {name}") for name, line in lines)
    sent.field_arcs.extend(_arc(arc, f"{at}, Field Arcs, {name}") for name, arc in arcs)
    return sent


def _ball_models(settings: Any) -> SSL_GeometryModels:
    def numbers(called: str, names: Mapping[str, str]) -> dict[str, float] | None:
        if not isinstance(settings, dict) or called not in settings:
            return None
        at = f"Models, {called}"
        return {name: _number(settings[called], title, at) for name, title in names.items()}

    return build(
        SSL_GeometryModels,
        straight_two_phase=numbers("Straight Two-Phase", STRAIGHT),
        chip_fixed_loss=numbers("Chip fix loss", CHIP),
    )


def _listed(settings: JsonObject, name: str) -> list[tuple[str, Any]]:
    found = settings.get(name)
    return [*found.items()] if isinstance(found, dict) else []


def _line(line: Any, at: str) -> SSL_FieldLineSegment:
    return build(
        SSL_FieldLineSegment,
        p1=_point(line, "P1", at),
        p2=_point(line, "P2", at),
        thickness=_number(line, "Line thickness", at),
        **_called(line, at),
    )


def _arc(arc: Any, at: str) -> SSL_FieldCircularArc:
    return build(
        SSL_FieldCircularArc,
        center=_point(arc, "Center", at),
        radius=_number(arc, "Radius", at),
        a1=_number(arc, "Start angle", at),
        a2=_number(arc, "End angle", at),
        thickness=_number(arc, "Line thickness", at),
        **_called(arc, at),
    )


def _point(marking: Any, name: str, at: str) -> Vector2f:
    return Vector2f(x=_number(marking, f"{name}.x", at), y=_number(marking, f"{name}.y", at))


def _called(marking: Any, at: str) -> JsonObject:
    name, kind = (str(require(marking, key, at))[:60] for key in ("Name", "Type"))
    return {"name": name, "type": kind if kind in SHAPES else "Undefined"}


def _camera(calibrator: JsonObject, at: str, field: Field) -> CameraFile:
    parameters = calibrator["Camera Parameters"]
    at = f"{at}, Camera Parameters"
    size = _size(calibrator.get("Calibration Parameters"))
    if isinstance(parameters, dict) and parameters.get(USES_OPENCV) == "true":
        return _opencv_camera(parameters, at, size, field)

    focal, x, y, distortion, *rest = (_number(parameters, name, at) for name in SSL_NUMBERS)
    pose = pose_from_quaternion(np.array(rest[:4]), np.array(rest[4:]))
    return CameraFile(
        FILE, "ssl", (distortion,), (focal, focal), (x, y), size, pose=pose, field=field
    )


def _opencv_camera(
    parameters: JsonObject, at: str, size: ImageSize | None, field: Field
) -> CameraFile:
    inner, outer = (
        require(parameters, name, at) for name in ("Intrinsic Parameters", "Extrinsic Parameters")
    )
    terms = tuple(
        _number(inner, f"dist_coeff_{name}", f"{at}, Intrinsic Parameters") for name in TERMS[:5]
    )
    fx, fy, cx, cy = (
        _number(inner, f"{name}_{axis}", f"{at}, Intrinsic Parameters")
        for name in ("focal_length", "principal_point")
        for axis in "xy"
    )
    rotation, translation_mm = (
        tuple(_number(outer, f"{name} {axis}", f"{at}, Extrinsic Parameters") for axis in "xyz")
        for name in ("rvec", "tvec")
    )
    model, terms = lens_from_terms(terms, at)
    pose = pose_from_field(rotation, np.array(translation_mm))
    return CameraFile(FILE, model, terms, (fx, fy), (cx, cy), size, pose=pose, field=field)


def _size(about: Any) -> ImageSize | None:
    """Return the size of the camera's pictures; None where it has had none yet."""
    if not isinstance(about, dict) or about.get("Image width", "0") == "0":
        return None
    return checked_size(about["Image width"], about.get("Image height"))
