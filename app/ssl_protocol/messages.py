"""The Small Size League's messages: one SSL_WrapperPacket in each UDP datagram, lengths in mm, floats of four bytes.

A camera of theirs: rays = rotate(q, field) + t with the quaternion q = (q0, q1, q2, q3) = (x, y, z, w) from the field
to the camera; plane = rays / Z; undistorted radius = r (1 + distortion · r²); pixel = principal point + focal · plane.
tz is measured along the optical axis: the camera's height above the carpet is derived_camera_world_tz.
"""

from dataclasses import dataclass
from enum import IntEnum

from app.ssl_protocol.protobuf import optional, repeated, required

# ruff: noqa: RUF009 — required() and its like only describe a field


class Shape(IntEnum):
    """SSL_FieldShapeType."""

    UNDEFINED = 0
    CENTER_CIRCLE = 1
    TOP_TOUCH_LINE = 2
    BOTTOM_TOUCH_LINE = 3
    LEFT_GOAL_LINE = 4
    RIGHT_GOAL_LINE = 5
    HALFWAY_LINE = 6
    CENTER_LINE = 7
    LEFT_PENALTY_STRETCH = 8
    RIGHT_PENALTY_STRETCH = 9
    LEFT_FIELD_LEFT_PENALTY_STRETCH = 10
    LEFT_FIELD_RIGHT_PENALTY_STRETCH = 11
    RIGHT_FIELD_LEFT_PENALTY_STRETCH = 12
    RIGHT_FIELD_RIGHT_PENALTY_STRETCH = 13


class Sender(IntEnum):
    """SSL_Source."""

    UNKNOWN = 0
    OTHER = 1
    SSL_VISION = 2
    VISION_PROCESSOR = 3
    GRSIM = 4
    ERFORCE_SIM = 5


@dataclass(frozen=True)
class Vector2f:
    x: float = required(1, "float")
    y: float = required(2, "float")


@dataclass(frozen=True)
class FieldLine:
    """SSL_FieldLineSegment."""

    name: str = required(1, "string")
    p1: Vector2f = required(2, Vector2f)
    p2: Vector2f = required(3, Vector2f)
    thickness: float = required(4, "float")
    type: int | None = optional(5, "enum")


@dataclass(frozen=True)
class FieldArc:
    """SSL_FieldCircularArc; a1 and a2 in radians."""

    name: str = required(1, "string")
    center: Vector2f = required(2, Vector2f)
    radius: float = required(3, "float")
    a1: float = required(4, "float")
    a2: float = required(5, "float")
    thickness: float = required(6, "float")
    type: int | None = optional(7, "enum")


@dataclass(frozen=True)
class FieldSize:
    """SSL_GeometryFieldSize."""

    field_length: int = required(1, "int32")
    field_width: int = required(2, "int32")
    goal_width: int = required(3, "int32")
    goal_depth: int = required(4, "int32")
    boundary_width: int = required(5, "int32")
    field_lines: tuple[FieldLine, ...] = repeated(6, FieldLine)
    field_arcs: tuple[FieldArc, ...] = repeated(7, FieldArc)
    penalty_area_depth: int | None = optional(8, "int32")
    penalty_area_width: int | None = optional(9, "int32")
    center_circle_radius: int | None = optional(10, "int32")
    line_thickness: int | None = optional(11, "int32")
    goal_center_to_penalty_mark: int | None = optional(12, "int32")
    goal_height: int | None = optional(13, "int32")
    ball_radius: float | None = optional(14, "float")
    max_robot_radius: float | None = optional(15, "float")
    boundary_width_goal_line: int | None = optional(16, "int32")
    goal_substitution_area_width: int | None = optional(17, "int32")


@dataclass(frozen=True)
class CameraCalibration:
    """SSL_GeometryCameraCalibration."""

    camera_id: int = required(1, "uint32")
    focal_length: float = required(2, "float")
    principal_point_x: float = required(3, "float")
    principal_point_y: float = required(4, "float")
    distortion: float = required(5, "float")
    q0: float = required(6, "float")
    q1: float = required(7, "float")
    q2: float = required(8, "float")
    q3: float = required(9, "float")
    tx: float = required(10, "float")
    ty: float = required(11, "float")
    tz: float = required(12, "float")
    derived_camera_world_tx: float | None = optional(13, "float")
    derived_camera_world_ty: float | None = optional(14, "float")
    derived_camera_world_tz: float | None = optional(15, "float")
    pixel_image_width: int | None = optional(16, "uint32")
    pixel_image_height: int | None = optional(17, "uint32")


@dataclass(frozen=True)
class Geometry:
    """SSL_GeometryData; its third field, the league's ball models, is nobody's business here."""

    field: FieldSize = required(1, FieldSize)
    calib: tuple[CameraCalibration, ...] = repeated(2, CameraCalibration)


@dataclass(frozen=True, kw_only=True)
class DetectedBall:
    """SSL_DetectionBall."""

    confidence: float = required(1, "float")
    area: int | None = optional(2, "uint32")
    x: float = required(3, "float")
    y: float = required(4, "float")
    z: float | None = optional(5, "float")
    pixel_x: float = required(6, "float")
    pixel_y: float = required(7, "float")


@dataclass(frozen=True, kw_only=True)
class DetectedRobot:
    """SSL_DetectionRobot."""

    confidence: float = required(1, "float")
    robot_id: int | None = optional(2, "uint32")
    x: float = required(3, "float")
    y: float = required(4, "float")
    orientation: float | None = optional(5, "float")
    pixel_x: float = required(6, "float")
    pixel_y: float = required(7, "float")
    height: float | None = optional(8, "float")


@dataclass(frozen=True, kw_only=True)
class DetectionFrame:
    """SSL_DetectionFrame; times in unix seconds."""

    frame_number: int = required(1, "uint32")
    t_capture: float = required(2, "double")
    t_sent: float = required(3, "double")
    camera_id: int = required(4, "uint32")
    balls: tuple[DetectedBall, ...] = repeated(5, DetectedBall)
    robots_yellow: tuple[DetectedRobot, ...] = repeated(6, DetectedRobot)
    robots_blue: tuple[DetectedRobot, ...] = repeated(7, DetectedRobot)
    t_capture_camera: float | None = optional(8, "double")


@dataclass(frozen=True)
class WrapperPacket:
    """SSL_WrapperPacket."""

    detection: DetectionFrame | None = optional(1, DetectionFrame)
    geometry: Geometry | None = optional(2, Geometry)
    source: int | None = optional(3, "enum")
