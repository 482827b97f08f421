"""ssl-vision: one SSL_WrapperPacket with the field's geometry and a camera's calibration, as the league multicasts it.

Its lens has one term and square pixels, its floats four bytes; every export reports that error.
"""

from touchline.core.errors import Conflict
from touchline.core.records import Calibration
from touchline.formats import Format
from touchline.formats.approximation import ExportCamera
from touchline.formats.camera_file import CameraFile
from touchline.formats.numbers import format_error
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.formats.ssl_geometry import camera_from_wire, camera_number, camera_to_wire
from touchline.models.restored import Restored
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryData, SSL_Source, SSL_WrapperPacket


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    _, field, region = Restored.of(calibration)
    number = camera_number(field, region) if export.camera_id is None else export.camera_id
    geometry = SSL_GeometryData(field=field_to_wire(field), calib=[camera_to_wire(export.camera, number)])
    return encode(SSL_WrapperPacket(geometry=geometry, source=SSL_Source.OTHER))


def recognises(data: bytes) -> bool:
    """Recognise a packet by the tag of its first message, with which no text begins."""
    return data[:1] in (b"\x0a", b"\x12", b"\x18") and any(byte < 9 for byte in data[:64])


def read(data: bytes, camera_id: int | None = None) -> CameraFile:
    """Read the camera with this id, or the only one."""
    geometry = decode(SSL_WrapperPacket, data).geometry
    if not geometry.calib:
        raise format_error("The packet contains no camera calibration.", "Use a geometry packet with calib.")
    ids = [camera.camera_id for camera in geometry.calib]
    if camera_id is None and len(ids) > 1:
        raise Conflict(f"The packet contains the cameras {', '.join(map(str, ids))}.", "Enter one: camera_id.",
                       reason="several-cameras")
    if camera_id is not None and camera_id not in ids:
        raise Conflict(f"The packet contains no camera {camera_id}.", f"It has {', '.join(map(str, ids))}.",
                       reason="no-such-camera")
    sent = geometry.calib[0 if camera_id is None else ids.index(camera_id)]
    return camera_from_wire(sent, field_from_wire(geometry.field))


FORMAT = Format("SSL-Vision geometry", "application/x-protobuf", ".pb",
                "The league's one-term lens, with the pose and the field.", write, read, recognises,
                lenses={"ssl": ("a",)}, square_pixels=True)
