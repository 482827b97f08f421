"""Geometry as the league's two vision programs generate it, from their coordinates, and pixels to field by their rules.

Coordinates, order and sizes are those of ssl-vision's RoboCupField and of vision-processor's geometry publisher; the
messages are described by hand in ssl_listener.py.
"""

import math

import numpy as np

from tests.support import ssl_listener as listener

SIZES = {  # length, width, goal width, penalty depth, penalty width, goal line to penalty mark
    "ssl-div-a": (12000, 9000, 1800, 1800, 3600, 8000),
    "ssl-div-b": (9000, 6000, 1000, 1000, 2000, 6000),
}
PROGRAMS = ("ssl-vision", "vision-processor")
MODELS = {  # acc_slide, acc_roll, k_switch; damping_xy_first_hop, damping_xy_other_hops, damping_z
    "ssl-vision": ((-3.0, -0.4, 0.7), (0.6, 0.95, 0.7)),
    "vision-processor": ((-3.4, -0.45, 0.64), (0.55, 0.88, 0.54)),
}
WHOLE_TURN = {"ssl-vision": math.tau, "vision-processor": 6.283185}
# what a message has had since 2018 or later
NEWER = (
    *("penalty_area_depth", "penalty_area_width", "center_circle_radius", "line_thickness"),
    *("goal_center_to_penalty_mark", "goal_height", "ball_radius", "max_robot_radius"),
    *("boundary_width_goal_line", "goal_substitution_area_width"),
)


def lines_of(program: str, division: str) -> list[tuple[str, float, float, float, float]]:
    """Name, from x, from y, to x, to y of every line, in the program's order and from the end where it begins."""
    length, width, _, depth, across, _ = SIZES[division]
    h, w, p, q = length / 2, width / 2, length / 2 - depth, across / 2
    outer = [
        ("TopTouchLine", -h, w, h, w),
        ("BottomTouchLine", -h, -w, h, -w),
        ("LeftGoalLine", -h, -w, -h, w),
        ("RightGoalLine", h, -w, h, w),
        ("HalfwayLine", 0, -w, 0, w),
    ]
    middle = ("CenterLine", -h, 0, h, 0)
    fronts = [
        ("LeftPenaltyStretch", -p, -q, -p, q),
        ("RightPenaltyStretch", p, -q, p, q),
        ("LeftFieldLeftPenaltyStretch", -h, -q, -p, -q),
        ("LeftFieldRightPenaltyStretch", -h, q, -p, q),
    ]
    if program == "ssl-vision":
        return [
            *outer,
            *fronts,
            ("RightFieldRightPenaltyStretch", h, -q, p, -q),
            ("RightFieldLeftPenaltyStretch", h, q, p, q),
            middle,
        ]
    return [
        *outer,
        middle,
        *fronts,
        ("RightFieldLeftPenaltyStretch", p, q, h, q),
        ("RightFieldRightPenaltyStretch", p, -q, h, -q),
    ]


def packet_of(program: str, division: str, without: tuple[str, ...] = (), is_older: bool = False):
    """The program's packet, without cameras. without: names of lines that the hall has not painted.

    is_older: as before 2018, without the newer fields, types and ball models.
    """
    length, width, goal, depth, across, mark = SIZES[division]
    is_processor = program == "vision-processor"
    packet = listener.Packet(source=PROGRAMS.index(program) + 2)
    field = packet.geometry.field
    for name, value in {
        "field_length": length,
        "field_width": width,
        "goal_width": goal,
        "goal_depth": 180,
        "boundary_width": 300,
        "penalty_area_depth": depth,
        "penalty_area_width": across,
        "center_circle_radius": 500,
        "line_thickness": 10,
        "goal_center_to_penalty_mark": mark,
        "goal_height": 160 if is_processor else 155,
        "ball_radius": 21.5,
        "max_robot_radius": 90.0,
        "boundary_width_goal_line": 300 if is_processor else 600,
        "goal_substitution_area_width": 0 if is_processor else 300,
    }.items():
        setattr(field, name, value)
    types = (
        listener.CLASSES["SSL_FieldLineSegment"]
        .DESCRIPTOR.fields_by_name["type"]
        .enum_type.values_by_name
    )
    for name, *ends in lines_of(program, division):
        if name not in without:
            line = field.field_lines.add(
                name=name, thickness=10.0, type=types[f"SSL_FieldShapeType_{name}"].number
            )
            line.p1.x, line.p1.y, line.p2.x, line.p2.y = ends
    arc = field.field_arcs.add(
        name="CenterCircle", radius=500.0, a1=0.0, a2=WHOLE_TURN[program], thickness=10.0, type=1
    )
    arc.center.x = arc.center.y = 0.0
    if is_older:
        for name in NEWER:
            field.ClearField(name)
        for marking in (*field.field_lines, *field.field_arcs):
            marking.ClearField("type")
        return packet
    roll, hop = packet.geometry.models.straight_two_phase, packet.geometry.models.chip_fixed_loss
    rolls, hops = MODELS[program]
    roll.acc_slide, roll.acc_roll, roll.k_switch = rolls
    hop.damping_xy_first_hop, hop.damping_xy_other_hops, hop.damping_z = hops
    return packet


def ssl_vision_image2field(calib, pixels, z_mm: float = 0.0) -> np.ndarray:
    """Pixels (n, 2) to field mm (n, 2) at that height by ssl-vision's rule, in doubles."""
    plane = (pixels - (calib.principal_point_x, calib.principal_point_y)) / calib.focal_length
    radius = np.linalg.norm(plane, axis=1, keepdims=True)
    plane = plane / np.where(radius > 0, radius, 1) * (radius * (1 + radius**2 * calib.distortion))
    return _on_plane(
        _matrix(calib, np.float64), plane, np.array([calib.tx, calib.ty, calib.tz]), z_mm
    )


def vision_processor_image2field(calib, pixels, z_mm: float = 0.0) -> np.ndarray:
    """The same by vision-processor's: floats of four bytes throughout."""
    f = np.float32
    plane = (
        pixels.astype(f) - np.array([calib.principal_point_x, calib.principal_point_y], f)
    ) / f(calib.focal_length)
    plane = plane * (
        f(1) + f(calib.distortion) * np.sum(plane * plane, axis=1, keepdims=True, dtype=f)
    )
    return _on_plane(_matrix(calib, f), plane, np.array([calib.tx, calib.ty, calib.tz], f), f(z_mm))


def _matrix(calib, kind) -> np.ndarray:
    q = np.array([calib.q0, calib.q1, calib.q2, calib.q3], kind)
    x, y, z, w = q / np.sqrt(np.sum(q * q, dtype=kind))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ],
        kind,
    )


def _on_plane(turn, plane, shift, z_mm) -> np.ndarray:
    rays = np.concatenate([plane, np.ones((len(plane), 1), plane.dtype)], axis=1) @ turn
    position = -shift @ turn
    return (position + rays * ((z_mm - position[2]) / rays[:, 2])[:, None])[:, :2]
