"""Convert a field to and from the Small Size League's message, and recognise one that is known by its geometry.

The league has its own names of lines; a line without one is sent under our name. Left and right of a defence area are
those of a goalkeeper who looks out: of the left one, right is up; of the right one, left is up.
"""

import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Arc, Field, Line
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, Mask
from touchline.formats.numbers import format_error
from touchline.ssl_protocol.protobuf import build
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_FieldCircularArc,
    SSL_FieldLineSegment,
    SSL_GeometryFieldSize,
    Vector2f,
)

SAME_MM = 0.5  # they send whole millimetres, and floats of four bytes
WHOLE_TURN = 2 * np.pi - 1e-3  # some send 6.283185

NAMES = {  # ours: theirs, which names its shape as well
    "touch-line-top": "TopTouchLine",
    "touch-line-bottom": "BottomTouchLine",
    "goal-line-left": "LeftGoalLine",
    "goal-line-right": "RightGoalLine",
    "halfway-line": "HalfwayLine",
    "centre-line": "CenterLine",
    "defence-left-front": "LeftPenaltyStretch",
    "defence-right-front": "RightPenaltyStretch",
    "defence-left-bottom": "LeftFieldLeftPenaltyStretch",
    "defence-left-top": "LeftFieldRightPenaltyStretch",
    "defence-right-top": "RightFieldLeftPenaltyStretch",
    "defence-right-bottom": "RightFieldRightPenaltyStretch",
    "centre-circle": "CenterCircle",
}
OURS = {theirs: ours for ours, theirs in NAMES.items()}
DEFENCE_SIDE = re.compile(r"defence-(left|right)-(top|bottom)")
# where a field has none: required on the wire
GOAL_MM = {"width_mm": 1000, "depth_mm": 180, "height_mm": 160}


def known_field(sent: SSL_GeometryFieldSize, known: Iterable[Field]) -> Field | None:
    """Return the field of the same size whose markings are those of the message, or None.

    Either may lack markings that the other has: programs leave out what a hall has not painted. Of several the one
    counts that has the most in common, then the one with the same goal.
    """
    found = []
    for field in known:
        if (round(field.length_mm), round(field.width_mm)) == (sent.field_length, sent.field_width):
            ours, theirs = _markings(field), _sent_markings(sent)
            alone = [
                sum(_alone(a, b).sum() for a, b in zip(one, other, strict=True))
                for one, other in ((ours, theirs), (theirs, ours))
            ]
            if min(alone) == 0:
                goal_mm = field.extras.get("goal", {}).get("width_mm", 0)
                found.append(((sum(alone), round(goal_mm) != sent.goal_width), field))
    return min(found, key=lambda one: one[0])[1] if found else None


def markings_alone(of: SSL_GeometryFieldSize, among: SSL_GeometryFieldSize) -> list[str]:
    """Return the names of the markings that one message has and another has not at their place."""
    names = ([line.name for line in of.field_lines], [arc.name for arc in of.field_arcs])
    pairs = zip(names, _sent_markings(of), _sent_markings(among), strict=True)
    return [
        name
        for given, one, other in pairs
        for name, alone in zip(given, _alone(one, other), strict=True)
        if alone
    ]


def _alone(of: Array, among: Array) -> Mask:
    """Tell which rows of `of` are near no row of `among`."""
    if not len(of) or not len(among):
        return np.ones(len(of), bool)
    apart_mm: Array = np.abs(of[:, None] - among[None]).max(axis=-1).min(axis=1)
    return apart_mm > SAME_MM


def _sent_markings(sent: SSL_GeometryFieldSize) -> tuple[Array, Array]:
    return (
        _lines([(line.p1.x, line.p1.y, line.p2.x, line.p2.y) for line in sent.field_lines]),
        _arcs(
            [(arc.center.x, arc.center.y, arc.radius, arc.a1, arc.a2) for arc in sent.field_arcs]
        ),
    )


def _markings(field: Field) -> tuple[Array, Array]:
    return (
        _lines([(*line.start, *line.end) for line in field.lines.values()]),
        _arcs(
            [
                (*arc.centre, arc.radius_mm, *np.radians((arc.start_deg, arc.end_deg)))
                for arc in field.arcs.values()
            ]
        ),
    )


def _lines(ends: list[tuple[float, ...]]) -> Array:
    """Lines as their middles and half their lengths (n, 4) mm: the same from either end."""
    x0, y0, x1, y1 = np.array(ends, float).reshape(-1, 4).T
    turned = (x1 < x0 - SAME_MM) | ((np.abs(x1 - x0) <= SAME_MM) & (y1 < y0))
    sign = np.where(turned, -1.0, 1.0)
    return np.stack(
        [(x0 + x1) / 2, (y0 + y1) / 2, sign * (x1 - x0) / 2, sign * (y1 - y0) / 2], axis=-1
    )


def _arcs(arcs: list[tuple[float, ...]]) -> Array:
    """Arcs as centre, radius, and both ends relative to it (n, 7) mm; of a whole circle the ends do not count."""
    x, y, radius, start, end = np.array(arcs, float).reshape(-1, 5).T
    part = np.where(np.abs(end - start) < WHOLE_TURN, radius, 0.0)
    return np.stack(
        [
            x,
            y,
            radius,
            part * np.cos(start),
            part * np.sin(start),
            part * np.cos(end),
            part * np.sin(end),
        ],
        axis=-1,
    )


def field_to_wire(field: Field) -> SSL_GeometryFieldSize:
    """Encode a field with all lines and arcs; lengths that must be whole are rounded."""
    extras = field.extras
    goal, boundary = (
        {**GOAL_MM, **extras.get("goal", {})},
        extras.get("boundary", {"touch_mm": 0, "goal_mm": 0}),
    )
    front = field.lines.get("defence-left-front")
    circle, mark = field.arcs.get("centre-circle"), field.landmarks.get("penalty-mark-left")
    widths = [line.width_mm for line in field.lines.values()]
    return build(
        SSL_GeometryFieldSize,
        field_length=round(field.length_mm),
        field_width=round(field.width_mm),
        goal_width=round(goal["width_mm"]),
        goal_depth=round(goal["depth_mm"]),
        boundary_width=round(boundary["touch_mm"]),
        field_lines=[_line(line) for line in field.lines.values()],
        field_arcs=[_arc(arc) for arc in field.arcs.values()],
        penalty_area_depth=None
        if front is None
        else round(field.length_mm / 2 - abs(front.start[0])),
        penalty_area_width=None if front is None else round(abs(front.end[1] - front.start[1])),
        center_circle_radius=None if circle is None else round(circle.radius_mm),
        line_thickness=round(float(np.median(widths))) if widths else None,
        goal_center_to_penalty_mark=None
        if mark is None
        else round(field.length_mm / 2 + abs(mark.position[0])),
        goal_height=round(goal["height_mm"]),
        ball_radius=extras["ball"]["radius_mm"] if "ball" in extras else None,
        max_robot_radius=extras["robot"]["radius_mm"] if "robot" in extras else None,
        boundary_width_goal_line=round(boundary["goal_mm"]),
    )


def field_from_wire(sent: SSL_GeometryFieldSize, known: Iterable[Field] = ()) -> Field:
    """Return the known field that matches the message, or one made of it; BadInput where it is no field."""
    if (field := known_field(sent, known)) is not None:
        return field
    length, width = float(sent.field_length), float(sent.field_width)
    x, y = length / 2, width / 2
    regions = {
        "full": ((-x, x), (-y, y)),
        "half-left": ((-x, 0.0), (-y, y)),
        "half-right": ((0.0, x), (-y, y)),
        "quarter-bottom-left": ((-x, 0.0), (-y, 0.0)),
        "quarter-top-left": ((-x, 0.0), (0.0, y)),
        "quarter-bottom-right": ((0.0, x), (-y, 0.0)),
        "quarter-top-right": ((0.0, x), (0.0, y)),
    }
    extras: dict[str, Any] = {
        "goal": {
            "width_mm": sent.goal_width,
            "depth_mm": sent.goal_depth,
            "height_mm": sent.goal_height or 160,
        },
        "boundary": {
            "touch_mm": sent.boundary_width,
            "goal_mm": sent.boundary_width_goal_line or sent.boundary_width,
        },
    }
    if sent.ball_radius:
        extras["ball"] = {"radius_mm": sent.ball_radius}
    try:
        return field_from_json(
            {
                "name": f"ssl-{sent.field_length}x{sent.field_width}",
                "title": f"Small Size League, {sent.field_length} × {sent.field_width} mm",
                "length_mm": length,
                "width_mm": width,
                "lines": _with_unique_names(
                    [
                        {
                            "name": _line_name(line),
                            "from": [line.p1.x, line.p1.y],
                            "to": [line.p2.x, line.p2.y],
                            "width_mm": line.thickness,
                        }
                        for line in sent.field_lines
                    ]
                ),
                "arcs": _with_unique_names(
                    [
                        {
                            "name": _our_name(arc.name),
                            "centre": [arc.center.x, arc.center.y],
                            "radius_mm": arc.radius,
                            "start_deg": round(float(np.degrees(arc.a1)), 3),
                            "end_deg": round(float(np.degrees(arc.a2)), 3),
                            "width_mm": arc.thickness,
                        }
                        for arc in sent.field_arcs
                    ]
                ),
                "landmarks": {
                    "centre": [0, 0],
                    "corner-top-left": [-x, y],
                    "corner-top-right": [x, y],
                    "corner-bottom-left": [-x, -y],
                    "corner-bottom-right": [x, -y],
                },
                "regions": {
                    name: {"x": list(xs), "y": list(ys)} for name, (xs, ys) in regions.items()
                },
                "extras": extras,
            }
        )
    except BadInput as refused:
        raise format_error(
            f"The field in the packet is not valid: {refused.what}", "Enter the field by name."
        ) from None


def _line(line: Line) -> SSL_FieldLineSegment:
    theirs = NAMES.get(line.name)
    return SSL_FieldLineSegment(
        name=theirs or line.name,
        p1=_point(line.start),
        p2=_point(line.end),
        thickness=line.width_mm,
        type=theirs or "Undefined",
    )


def _arc(arc: Arc) -> SSL_FieldCircularArc:
    theirs = NAMES.get(arc.name)
    return SSL_FieldCircularArc(
        name=theirs or arc.name,
        center=_point(arc.centre),
        radius=arc.radius_mm,
        a1=math.radians(arc.start_deg),
        a2=math.radians(arc.end_deg),
        thickness=arc.width_mm,
        type=theirs or "Undefined",
    )


def _point(place: Sequence[float]) -> Vector2f:
    return Vector2f(x=place[0], y=place[1])


def names_are_the_leagues(sent: SSL_GeometryFieldSize) -> bool:
    """Tell whether each named side of a defence area lies where the league's programs have it."""
    return all(_our_name(line.name) == _line_name(line) for line in sent.field_lines)


def _line_name(line: SSL_FieldLineSegment) -> str:
    """Return our name of a line. A side of a defence area is named by where it lies: programs disagreed on them."""
    name = _our_name(line.name)
    if DEFENCE_SIDE.fullmatch(name):
        x, y = line.p1.x + line.p2.x, line.p1.y + line.p2.y
        return f"defence-{'left' if x < 0 else 'right'}-{'bottom' if y < 0 else 'top'}"
    return name


def _our_name(name: str) -> str:
    """Return our name of a league line, or theirs in our spelling."""
    if name in OURS:
        return OURS[name]
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name[:60])
    return re.sub(r"[^a-z0-9]+", "-", spaced.lower()).strip("-") or "line"


def _with_unique_names(members: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Append a number to repeated names."""
    seen: dict[str, int] = {}
    for member in members:
        seen[member["name"]] = seen.get(member["name"], 0) + 1
        if seen[member["name"]] > 1:
            member["name"] = f"{member['name'][:56]}-{seen[member['name']]}"
    return members
