"""ssl-vision: cameras, and one SSL_WrapperPacket with the field's geometry and a camera's calibration.

The traps: their distortion a undistorts where OpenCV's k1 distorts, a ≈ -k1; their tz lies along the optical axis and
is not the camera's height; a negative a, pincushion, is as good as any other; the quaternion is x, y, z, w.

The league's lens has one term and square pixels, its floats four bytes; every export reports that error.
"""

import numpy as np

from touchline.core.errors import Conflict
from touchline.core.field import Field, Region
from touchline.core.geometry import Array
from touchline.core.records import Calibration
from touchline.formats import Format
from touchline.formats.approximation import ExportCamera, checked_pose
from touchline.formats.camera_file import CameraFile, translation_of
from touchline.formats.numbers import checked_size, format_error
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.models import Restored
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import vector_from_matrix
from touchline.ssl_protocol.protobuf import build, decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_GeometryCameraCalibration,
    SSL_GeometryData,
    SSL_Source,
    SSL_WrapperPacket,
)


def camera_to_wire(camera: RayCamera, camera_id: int) -> SSL_GeometryCameraCalibration:
    """Encode an Ssl camera; its numbers become floats of four bytes."""
    translation = translation_of(camera)
    x, y, z, w = quaternion(np.array(camera.rotation))
    width, height = camera.image_size
    return build(
        SSL_GeometryCameraCalibration,
        camera_id=camera_id,
        focal_length=camera.focal_px,
        principal_point_x=camera.centre_px[0],
        principal_point_y=camera.centre_px[1],
        distortion=camera.lens_terms[0],
        q0=x,
        q1=y,
        q2=z,
        q3=w,
        tx=float(translation[0]),
        ty=float(translation[1]),
        tz=float(translation[2]),
        derived_camera_world_tx=camera.position_mm[0],
        derived_camera_world_ty=camera.position_mm[1],
        derived_camera_world_tz=camera.position_mm[2],
        pixel_image_width=width,
        pixel_image_height=height,
    )


def camera_from_wire(sent: SSL_GeometryCameraCalibration, field: Field) -> CameraFile:
    """Decode a camera over this field. The position is that of q and t: the derived one only repeats it."""
    sized = sent.HasField("pixel_image_width") and sent.HasField("pixel_image_height")
    size = checked_size(sent.pixel_image_width, sent.pixel_image_height) if sized else None
    q = np.array([sent.q0, sent.q1, sent.q2, sent.q3])
    length = float(np.linalg.norm(q))
    if not 0.5 < length < 2:
        raise format_error(
            f"The camera's quaternion has the length {length:g}.",
            "Use a quaternion of length 1: x, y, z, w.",
        )
    rotation = matrix_from_quaternion(q / length)
    pose = checked_pose(
        vector_from_matrix(rotation), -rotation.T @ np.array([sent.tx, sent.ty, sent.tz])
    )
    return CameraFile(
        "ssl-vision",
        "ssl",
        (sent.distortion,),
        (sent.focal_length, sent.focal_length),
        (sent.principal_point_x, sent.principal_point_y),
        size,
        pose=pose,
        field=field,
    )


def quaternion(rotation: Array) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w), w ≥ 0, of a rotation vector."""
    angle = float(np.linalg.norm(rotation))
    half = np.sin(angle / 2) / angle * rotation if angle > 1e-12 else rotation / 2
    w = float(np.cos(angle / 2))
    x, y, z = map(float, half if w >= 0 else -half)
    return x, y, z, abs(w)


def matrix_from_quaternion(q: Array) -> Array:
    """Return the rotation matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def camera_number(field: Field, region: Region) -> int:
    """Return the number of the camera over this region of a shared field: columns along x, in each the lower y first.

    1 camera sees all; of 2, 0 has x < 0; of 4: 0 (-, -), 1 (-, +), 2 (+, -), 3 (+, +); of 8, columns of two.
    """
    x0, x1, y0, y1 = *region.x_mm, *region.y_mm
    columns, rows = (
        max(1, round(field.length_mm / (x1 - x0))),
        max(1, round(field.width_mm / (y1 - y0))),
    )
    column = int((x0 + x1) / 2 / field.length_mm * columns + columns / 2)
    row = int((y0 + y1) / 2 / field.width_mm * rows + rows / 2)
    return min(column, columns - 1) * rows + min(row, rows - 1)


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    _, field, region = Restored.of(calibration)
    number = camera_number(field, region) if export.camera_id is None else export.camera_id
    geometry = SSL_GeometryData(
        field=field_to_wire(field), calib=[camera_to_wire(export.camera, number)]
    )
    return encode(SSL_WrapperPacket(geometry=geometry, source=SSL_Source.OTHER))


def recognises(data: bytes) -> bool:
    """Recognise a packet by the tag of its first message, with which no text begins."""
    return data[:1] in (b"\x0a", b"\x12", b"\x18") and any(byte < 9 for byte in data[:64])


def read(data: bytes, camera_id: int | None = None) -> CameraFile:
    """Read the camera with this id, or the only one."""
    geometry = decode(SSL_WrapperPacket, data).geometry
    if not geometry.calib:
        raise format_error(
            "The packet contains no camera calibration.", "Use a geometry packet with calib."
        )
    ids = [camera.camera_id for camera in geometry.calib]
    if camera_id is None and len(ids) > 1:
        raise Conflict(
            f"The packet contains the cameras {', '.join(map(str, ids))}.",
            "Choose one of them. From a program, send its number as camera_id.",
            reason="several-cameras",
            entries=[*map(str, ids)],
        )
    if camera_id is not None and camera_id not in ids:
        raise Conflict(
            f"The packet contains no camera {camera_id}.",
            f"It has {', '.join(map(str, ids))}.",
            reason="no-such-camera",
        )
    sent = geometry.calib[0 if camera_id is None else ids.index(camera_id)]
    return camera_from_wire(sent, field_from_wire(geometry.field))


FORMAT = Format(
    "SSL-Vision geometry",
    "application/x-protobuf",
    ".pb",
    "The league's one-term lens, with the pose and the field.",
    write,
    read,
    recognises,
    lenses={"ssl": ("a",)},
    square_pixels=True,
)
