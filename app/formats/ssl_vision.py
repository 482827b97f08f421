"""ssl-vision: one SSL_WrapperPacket with the field's geometry and a camera's calibration, as the league multicasts it.

Its lens has one term and square pixels, its floats four bytes: what that costs is told with every export.
"""

from typing import ClassVar

from app.core.errors import Conflict
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile
from app.formats.numbers import refuse
from app.formats.ssl_field import field_from_wire, wire_field
from app.formats.ssl_geometry import camera_from_wire, camera_number, wire_camera
from app.ssl_protocol.messages import Geometry, Sender, WrapperPacket
from app.ssl_protocol.protobuf import decode, encode


class SslVision:
    NAME: ClassVar[str] = "ssl-vision"
    TITLE: ClassVar[str] = "SSL-Vision geometry"
    MEDIA_TYPE: ClassVar[str] = "application/x-protobuf"
    SUFFIX: ClassVar[str] = ".pb"
    HOLDS: ClassVar[str] = "The league's one-term lens, with the pose and the field."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = {"ssl": ("a",)}
    SQUARE_PIXELS: ClassVar[bool] = True

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        field = field_from_json(calibration.field)
        region = field.region(calibration.region, calibration.rotate)
        number = camera_number(field, region) if held.camera_id is None else held.camera_id
        return encode(WrapperPacket(geometry=Geometry(wire_field(field), (wire_camera(held.camera, number),)),
                                    source=int(Sender.OTHER)))

    @staticmethod
    def recognises(data: bytes) -> bool:
        """A packet begins with the tag of one of its messages; no text does."""
        return data[:1] in (b"\x0a", b"\x12", b"\x18") and any(byte < 9 for byte in data[:64])

    @staticmethod
    def read(data: bytes, camera_id: int | None = None) -> CameraFile:
        """The camera of that number; without one, the only camera there is."""
        geometry = decode(WrapperPacket, data).geometry
        if geometry is None or not geometry.calib:
            raise refuse("The packet holds no camera's calibration.", "Give a geometry packet with calib.")
        ids = [camera.camera_id for camera in geometry.calib]
        if camera_id is None and len(ids) > 1:
            raise Conflict(f"The packet holds the cameras {', '.join(map(str, ids))}.", "Say which: camera_id.",
                           reason="several-cameras")
        if camera_id is not None and camera_id not in ids:
            raise Conflict(f"The packet holds no camera {camera_id}.", f"It has {', '.join(map(str, ids))}.",
                           reason="no-such-camera")
        sent = geometry.calib[0 if camera_id is None else ids.index(camera_id)]
        return camera_from_wire(sent, field_from_wire(geometry.field))
