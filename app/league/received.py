"""What was heard in the group, as plain JSON: whose cameras hang where, and what of that contradicts us."""

import hashlib
import time
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from app.core.errors import TouchlineError
from app.core.field import Field
from app.formats.ssl_field import field_from_wire
from app.formats.ssl_geometry import camera_from_wire
from app.league.geometry_listener import Heard
from app.league.geometry_packet import Spoken
from app.ssl_protocol.messages import CameraCalibration, Sender
from app.ssl_protocol.protobuf import decode, encode

STALE_S = 30.0  # who has sent no geometry for so long contradicts nobody any more


def heard_json(sender: Heard, known: Iterable[Field], ours: Iterable[Spoken]) -> dict[str, Any]:
    """One sender; known: the fields of this house; ours: what we publish now."""
    now, geometry = time.monotonic(), sender.geometry
    told = {"id": sender.id, "address": sender.address, "port": sender.port, "source": source_name(sender.source),
            "age_s": round(now - sender.last_s, 3), "packets": sender.packets, "geometries": sender.geometries,
            "refused": sender.refused, "refusal": sender.why or None, "skipped": sender.skipped,
            "geometry_age_s": None, "sha256": None, "field": None, "problem": None, "cameras": []}
    if geometry is None:
        return told
    told |= {"geometry_age_s": round(now - sender.geometry_s, 3), "sha256": hashlib.sha256(sender.data).hexdigest()}
    numbers = {one.number: one for one in ours if one.sent is not None} if _fresh(sender) else {}
    try:
        known = tuple(known)
        field = field_from_wire(geometry.field, known)
        told["field"] = {"name": field.name, "title": field.title, "length_mm": field.length_mm,
                         "width_mm": field.width_mm, "known": any(field is one for one in known)}
    except TouchlineError as refused:
        return {**told, "problem": _problem(refused)}
    return {**told, "cameras": [_camera(sent, field, numbers.get(sent.camera_id)) for sent in geometry.calib]}


def contradictions(senders: Iterable[Heard], ours: Iterable[Spoken]) -> list[tuple[Heard, Spoken]]:
    """Who publishes another calibration for a number of ours, and which of our cameras that is."""
    return [(sender, one) for sender in senders for one in ours for sent in _fresh(sender)
            if one.sent is not None and one.number == sent.camera_id and not _same(one.sent, sent)]


def _fresh(sender: Heard) -> tuple[CameraCalibration, ...]:
    """The cameras of a sender that still says so."""
    old = sender.geometry is None or time.monotonic() - sender.geometry_s > STALE_S
    return () if old else sender.geometry.calib


def source_name(source: int) -> str:
    """SSL_Source in lower case: "ssl-vision"; "unknown" for a number that nobody has given yet."""
    return Sender(source).name.lower().replace("_", "-") if source in set(Sender) else "unknown"


def _camera(sent: CameraCalibration, field: Field, ours: Spoken | None) -> dict[str, Any]:
    told: dict[str, Any] = {"camera_id": sent.camera_id, "image_size": None, "position_mm": None,
                            "focal_px": sent.focal_length, "distortion": sent.distortion, "problem": None,
                            "ours": None if ours is None else ours.name,
                            "contradicts": ours is not None and not _same(ours.sent, sent)}
    try:
        file = camera_from_wire(sent, field)
    except TouchlineError as refused:
        return {**told, "problem": _problem(refused)}
    told["position_mm"] = [round(value, 1) for value in file.pose.position_mm]
    told["image_size"] = None if file.image_size is None else list(file.image_size)
    return told


def _same(ours: CameraCalibration, theirs: CameraCalibration) -> bool:
    """Whether they only repeat what we say: vision software that took our calibration over sends it on."""
    bare = {"derived_camera_world_tx": None, "derived_camera_world_ty": None, "derived_camera_world_tz": None,
            "pixel_image_width": None, "pixel_image_height": None}
    return replace(decode(CameraCalibration, encode(ours)), **bare) == replace(theirs, **bare)


def _problem(refused: TouchlineError) -> dict[str, str]:
    return {"reason": refused.reason, "what": refused.what, "fix": refused.fix}
