"""A listener to the Small Size League's packets with Google's protobuf, its messages described here by hand.

It shares no description with touchline/ssl_protocol: names, numbers, kinds and labels are those of the league's own.
"""

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

MESSAGES = {
    "Vector2f": "required float x 1; required float y 2",
    "SSL_FieldLineSegment": "required string name 1; required Vector2f p1 2; required Vector2f p2 3; "
    "required float thickness 4; optional SSL_FieldShapeType type 5",
    "SSL_FieldCircularArc": "required string name 1; required Vector2f center 2; required float radius 3; "
    "required float a1 4; required float a2 5; required float thickness 6; "
    "optional SSL_FieldShapeType type 7",
    "SSL_GeometryFieldSize": "required int32 field_length 1; required int32 field_width 2; "
    "required int32 goal_width 3; "
    "required int32 goal_depth 4; required int32 boundary_width 5; repeated SSL_FieldLineSegment field_lines 6; "
    "repeated SSL_FieldCircularArc field_arcs 7; optional int32 penalty_area_depth 8; "
    "optional int32 penalty_area_width 9; optional int32 center_circle_radius 10; "
    "optional int32 line_thickness 11; optional int32 goal_center_to_penalty_mark 12; "
    "optional int32 goal_height 13; optional float ball_radius 14; optional float max_robot_radius 15; "
    "optional int32 boundary_width_goal_line 16; optional int32 goal_substitution_area_width 17",
    "SSL_GeometryCameraCalibration": "required uint32 camera_id 1; required float focal_length 2; "
    "required float principal_point_x 3; "
    "required float principal_point_y 4; required float distortion 5; required float q0 6; required float q1 7; "
    "required float q2 8; required float q3 9; required float tx 10; required float ty 11; required float tz 12; "
    "optional float derived_camera_world_tx 13; optional float derived_camera_world_ty 14; "
    "optional float derived_camera_world_tz 15; optional uint32 pixel_image_width 16; "
    "optional uint32 pixel_image_height 17",
    "SSL_BallModelStraightTwoPhase": "required double acc_slide 1; required double acc_roll 2; "
    "required double k_switch 3",
    "SSL_BallModelChipFixedLoss": "required double damping_xy_first_hop 1; required double damping_xy_other_hops 2; "
    "required double damping_z 3",
    "SSL_GeometryModels": "optional SSL_BallModelStraightTwoPhase straight_two_phase 1; "
    "optional SSL_BallModelChipFixedLoss chip_fixed_loss 2",
    "SSL_GeometryData": "required SSL_GeometryFieldSize field 1; repeated SSL_GeometryCameraCalibration calib 2; "
    "optional SSL_GeometryModels models 3",
    "SSL_DetectionBall": "required float confidence 1; optional uint32 area 2; required float x 3; required float y 4; "
    "optional float z 5; required float pixel_x 6; required float pixel_y 7",
    "SSL_DetectionRobot": "required float confidence 1; optional uint32 robot_id 2; "
    "required float x 3; required float y 4; "
    "optional float orientation 5; required float pixel_x 6; required float pixel_y 7; optional float height 8",
    "SSL_DetectionFrame": "required uint32 frame_number 1; required double t_capture 2; required double t_sent 3; "
    "required uint32 camera_id 4; repeated SSL_DetectionBall balls 5; repeated SSL_DetectionRobot robots_yellow 6; "
    "repeated SSL_DetectionRobot robots_blue 7; optional double t_capture_camera 8",
    "SSL_WrapperPacket": "optional SSL_DetectionFrame detection 1; optional SSL_GeometryData geometry 2; "
    "optional SSL_Source source 3",
}
ENUMS = {
    "SSL_FieldShapeType": "Undefined CenterCircle TopTouchLine BottomTouchLine LeftGoalLine RightGoalLine HalfwayLine "
    "CenterLine LeftPenaltyStretch RightPenaltyStretch LeftFieldLeftPenaltyStretch "
    "LeftFieldRightPenaltyStretch RightFieldLeftPenaltyStretch RightFieldRightPenaltyStretch",
    "SSL_Source": "UNKNOWN OTHER SSL_VISION VISION_PROCESSOR GRSIM ERFORCE_SIM",
}
P = descriptor_pb2.FieldDescriptorProto
SCALARS = {
    "float": P.TYPE_FLOAT,
    "double": P.TYPE_DOUBLE,
    "int32": P.TYPE_INT32,
    "uint32": P.TYPE_UINT32,
    "string": P.TYPE_STRING,
}
LABELS = {"required": P.LABEL_REQUIRED, "optional": P.LABEL_OPTIONAL, "repeated": P.LABEL_REPEATED}


def _classes():
    file = descriptor_pb2.FileDescriptorProto(name="league.proto", syntax="proto2")
    for name, values in ENUMS.items():
        enum = file.enum_type.add(name=name)
        for number, value in enumerate(values.split()):
            enum.value.add(name=f"{name}_{value}", number=number)
    for name, described in MESSAGES.items():
        message = file.message_type.add(name=name)
        for part in described.split("; "):
            label, kind, field, tag = part.split()
            added = message.field.add(name=field, number=int(tag), label=LABELS[label])
            if kind in SCALARS:
                added.type = SCALARS[kind]
            else:
                added.type = P.TYPE_ENUM if kind in ENUMS else P.TYPE_MESSAGE
                added.type_name = f".{kind}"
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(name)) for name in MESSAGES
    }


CLASSES = _classes()
Packet = CLASSES["SSL_WrapperPacket"]


def projected(calib, places) -> np.ndarray:
    """As the league's description has it: x, y, z, w, made a unit; field → camera; r_u = r_d (1 + a r_d²)."""
    x, y, z, w = np.array([calib.q0, calib.q1, calib.q2, calib.q3]) / np.linalg.norm(
        [calib.q0, calib.q1, calib.q2, calib.q3]
    )
    v = np.array([x, y, z])
    turned = places + 2 * np.cross(v, np.cross(v, places) + w * places)
    camera = turned + np.array([calib.tx, calib.ty, calib.tz])
    plane = camera[:, :2] / camera[:, 2:]
    r_u = np.linalg.norm(plane, axis=1)
    r_d = r_u.copy()
    for _ in range(100):
        r_d -= (r_d * (1 + calib.distortion * r_d**2) - r_u) / (1 + 3 * calib.distortion * r_d**2)
    distorted = plane * np.where(r_u > 0, r_d / np.where(r_u > 0, r_u, 1), 1)[:, None]
    return distorted * calib.focal_length + np.array(
        [calib.principal_point_x, calib.principal_point_y]
    )


def looked_up(calib, pixels, z_mm: float = 0.0) -> np.ndarray:
    """The other way, which needs no iteration: where a pixel (n, 2) lies on the field, mm (n, 2), at that height."""
    x, y, z, w = np.array([calib.q0, calib.q1, calib.q2, calib.q3]) / np.linalg.norm(
        [calib.q0, calib.q1, calib.q2, calib.q3]
    )
    plane = (
        pixels - np.array([calib.principal_point_x, calib.principal_point_y])
    ) / calib.focal_length
    plane = plane * (1 + calib.distortion * np.sum(plane**2, axis=1, keepdims=True))

    def back(v):
        u = -np.array([x, y, z])
        return v + 2 * np.cross(u, np.cross(u, v) + w * v)

    rays = back(np.concatenate([plane, np.ones((len(plane), 1))], axis=1))
    centre = -back(np.array([[calib.tx, calib.ty, calib.tz]]))
    return (centre + rays * ((z_mm - centre[:, 2:]) / rays[:, 2:]))[:, :2]
