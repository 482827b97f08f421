"""What was received from other publishers, as JSON: their cameras, and which contradict ours."""

import hashlib
import time
from collections.abc import Iterable, Sequence
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.field import Field
from touchline.core.statements import stated
from touchline.formats.ssl_field import field_from_wire
from touchline.formats.ssl_geometry import camera_from_wire
from touchline.league.geometry_difference import geometry_differences
from touchline.league.geometry_listener import RemotePublisher
from touchline.league.geometry_packet import PublishedCamera
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryCameraCalibration, SSL_GeometryData

DERIVED = ("derived_camera_world_tx", "derived_camera_world_ty", "derived_camera_world_tz", "pixel_image_width",
           "pixel_image_height")  # of a calibration: they add nothing to it


def received_json(publisher: RemotePublisher, fields: Iterable[Field], ours: Iterable[PublishedCamera],
                  packet: SSL_GeometryData | None = None) -> dict[str, Any]:
    """Describe one publisher. fields: those known to this server; ours: the cameras that we publish now, in packet."""
    now, geometry = time.monotonic(), publisher.geometry
    found = {"id": publisher.id, "address": publisher.address, "port": publisher.port,
             "source": publisher.source_name, "age_s": round(now - publisher.last_s, 3),
             "packets": publisher.packets, "geometries": publisher.geometries, "refused": publisher.refused,
             "refusal": publisher.why or None, "skipped": publisher.skipped, "geometry_age_s": None, "sha256": None,
             "field": None, "problem": None, "cameras": [], "differs": []}
    if geometry is None:
        return found
    found |= {"geometry_age_s": round(now - publisher.geometry_s, 3),
              "sha256": hashlib.sha256(publisher.data).hexdigest()}
    numbers = {one.number: one for one in ours if one.sent is not None} if _current_cameras(publisher) else {}
    try:
        fields = tuple(fields)
        field = field_from_wire(geometry.field, fields)
        found["field"] = {"name": field.name, "title": field.title, "length_mm": field.length_mm,
                          "width_mm": field.width_mm, "known": any(field is one for one in fields)}
    except TouchlineError as error:
        return {**found, "problem": error.to_json()}
    differs = () if packet is None else geometry_differences(geometry, packet)
    return {**found, "differs": [stated({"text": text}) for text in differs],
            "cameras": [_camera(sent, field, numbers.get(sent.camera_id)) for sent in geometry.calib]}


def contradictions(publishers: Iterable[RemotePublisher], ours: Iterable[PublishedCamera],
                   ) -> list[tuple[RemotePublisher, PublishedCamera]]:
    """Pair each publisher with the camera of ours for whose number it sends another calibration."""
    return [(publisher, one) for publisher in publishers for one in ours for sent in _current_cameras(publisher)
            if one.sent is not None and one.number == sent.camera_id and not _same(one.sent, sent)]


def _current_cameras(publisher: RemotePublisher) -> Sequence[SSL_GeometryCameraCalibration]:
    """Return the cameras of geometry that is not stale."""
    geometry = publisher.geometry
    return geometry.calib if geometry is not None and publisher.is_current(time.monotonic()) else ()


def _camera(sent: SSL_GeometryCameraCalibration, field: Field, ours: PublishedCamera | None) -> dict[str, Any]:
    found = {"camera_id": sent.camera_id, "image_size": None, "position_mm": None,
             "focal_px": sent.focal_length, "distortion": sent.distortion, "problem": None,
             "ours": None if ours is None else ours.name,
             "contradicts": ours is not None and ours.sent is not None and not _same(ours.sent, sent)}
    try:
        file = camera_from_wire(sent, field)
    except TouchlineError as error:
        return {**found, "problem": error.to_json()}
    return {**found, "position_mm": None if file.pose is None else [round(value, 1) for value in file.pose.position_mm],
            "image_size": None if file.image_size is None else list(file.image_size)}


def _same(ours: SSL_GeometryCameraCalibration, theirs: SSL_GeometryCameraCalibration) -> bool:
    """Tell whether they only repeat ours: vision software that took our calibration over sends it on."""
    return _values(decode(SSL_GeometryCameraCalibration, encode(ours))) == _values(theirs)


def _values(sent: SSL_GeometryCameraCalibration) -> dict[str, object]:
    return {field.name: value for field, value in sent.ListFields() if field.name not in DERIVED}
