"""Encode calibrations as the league's geometry packet, with the error in mm that its one-term lens causes."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

from app.core.errors import Conflict, TouchlineError
from app.core.field import Field
from app.core.field_changes import FIELD_CHANGED_FIX, changes_in_words
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.core.statements import say
from app.evaluate.fit.approximation import ApproximationError, approximation_error
from app.formats.approximation import export_camera
from app.formats.ssl_field import field_to_wire
from app.formats.ssl_geometry import camera_from_wire, camera_number, camera_to_wire
from app.formats.ssl_vision import FORMAT as SSL_VISION
from app.league.config import PublishingConfig
from app.models.restored import Restored
from app.models.top_view import RECTANGLE_FIELDS
from app.ssl_protocol.protobuf import decode, encode
from app.ssl_protocol.ssl_vision_pb2 import (
    SSL_GeometryCameraCalibration,
    SSL_GeometryData,
    SSL_Source,
    SSL_WrapperPacket,
)

NO_FIELDS: Mapping[str, Field] = {}


@dataclass(frozen=True)
class WireCamera:
    """A calibration as the league's message, under its region's number.

    loss: error of that message, decoded as a listener does, against the calibration. exact: whether the model is the
    league's own, so that only the rounding to four bytes is lost.
    """

    sent: SSL_GeometryCameraCalibration
    loss: ApproximationError
    exact: bool


@dataclass(frozen=True)
class PublishedCamera:
    """One camera of the packet, or the problem that keeps it out."""

    calibration: Calibration
    number: int
    wire: WireCamera | None = None
    problem: TouchlineError | None = None

    @property
    def name(self) -> str:
        return self.calibration.camera or self.calibration.id

    @property
    def sent(self) -> SSL_GeometryCameraCalibration | None:
        """The message in the packet; None where the camera is left out."""
        if self.wire is None or self.problem is not None:
            return None
        sent = deepcopy(self.wire.sent)
        sent.camera_id = self.number
        return sent

    def to_json(self) -> dict[str, Any]:
        c, wire, problem = self.calibration, self.wire, self.problem
        loss = None if wire is None or not math.isfinite(wire.loss.worst_at_any_height_mm) else wire.loss.to_json()
        return {"camera": self.name, "calibration": c.id, "version": c.version, "model": c.model_name,
                "field": c.field["name"], "region": c.region, "camera_id": self.number,
                "published": self.sent is not None, "exact": wire is not None and wire.exact, "loss": loss,
                "problem": problem and problem.to_json()}


class WireCameraCache:
    """Encodes each calibration once: a version never changes, and approximating its lens takes a while."""

    CAPACITY = 64

    def __init__(self) -> None:
        self._cache: dict[str, WireCamera | TouchlineError] = {}

    def __call__(self, calibration: Calibration) -> WireCamera | TouchlineError:
        """Return the message, or why the league's lens cannot represent the calibration."""
        if calibration.id not in self._cache:
            while len(self._cache) >= self.CAPACITY:
                self._cache.pop(next(iter(self._cache)), None)
            self._cache[calibration.id] = wire_camera(calibration)
        return self._cache[calibration.id]


def wire_camera(calibration: Calibration) -> WireCamera | TouchlineError:
    """Encode a calibration and measure the loss, or return why the league's lens cannot represent it."""
    try:
        model, field, region = Restored.of(calibration)
        camera = export_camera(calibration, SSL_VISION, approximate=True)
        sent = camera_to_wire(camera.camera, camera_number(field, region))
        read = camera_from_wire(decode(SSL_GeometryCameraCalibration, encode(sent)), field)
        back = read.camera({name: getattr(camera.camera, name) for name in RECTANGLE_FIELDS})
        return WireCamera(sent, approximation_error(model, back, region, field.hat_height_mm), camera.loss is None)
    except TouchlineError as refused:
        return refused


def published_cameras(calibrations: Sequence[Calibration], config: PublishingConfig,
                      encode_camera: Callable[[Calibration], WireCamera | TouchlineError] = wire_camera,
                      fields: Mapping[str, Field] = NO_FIELDS) -> tuple[PublishedCamera, ...]:
    """Return each camera as it would be sent, or why not: its lens, loss, number and field are checked.

    fields: as they are now; a calibration made when its field was otherwise is not sent.
    """
    name = _field(calibrations, config)
    field = fields[name].to_json() if name is not None and name in fields else None
    cameras: list[PublishedCamera] = []
    for calibration in calibrations:
        made = encode_camera(calibration)
        if isinstance(made, TouchlineError):
            cameras.append(PublishedCamera(calibration, config.numbers.get(calibration.camera or "", 0), None, made))
            continue
        one = PublishedCamera(calibration, config.numbers.get(calibration.camera or "", made.sent.camera_id), made)
        worst_mm = made.loss.worst_at_any_height_mm
        cameras.append(replace(one, problem=_problem(one, worst_mm, cameras, config, name, field)))
    return tuple(cameras)


def geometry_packet(candidates: Iterable[PublishedCamera], fields: Mapping[str, Field] = NO_FIELDS) -> bytes | None:
    """Encode all cameras that are sent, with their field as it is now; None where there is none."""
    cameras = [(one.calibration, sent) for one in candidates if (sent := one.sent) is not None]
    if not cameras:
        return None
    newest = max((calibration for calibration, _ in cameras), key=lambda one: one.created_at).field
    field = fields[newest["name"]] if newest["name"] in fields else field_from_json(newest)
    geometry = SSL_GeometryData(field=field_to_wire(field), calib=[sent for _, sent in cameras])
    return encode(SSL_WrapperPacket(geometry=geometry, source=SSL_Source.OTHER))


def _field(calibrations: Iterable[Calibration], config: PublishingConfig) -> str | None:
    """Choose the packet's one field: the configured one, else that of most cameras, the first of equals."""
    if config.field is not None:
        return config.field
    names = Counter(calibration.field["name"] for calibration in calibrations)
    return max(names, key=lambda name: names[name], default=None)


def _problem(one: PublishedCamera, worst_mm: float, before: Iterable[PublishedCamera], config: PublishingConfig,
             field_name: str | None, field: Mapping[str, Any] | None) -> TouchlineError | None:
    """Return why an encoded camera is left out; None where it is sent."""
    name = one.name
    if one.calibration.field["name"] != field_name:
        return Conflict(say("publishing.other-field", "{camera} covers the field {covered}, but a packet has one "
                            "field: {field}.", camera=name, covered=one.calibration.field["name"], field=field_name),
                        say("publishing.change-field", "Publish that field instead, or change the field of this "
                            "camera."), reason="other-field")
    if field is not None and (changes := one.calibration.field_changes(field)):
        return Conflict(say("publishing.field-changed", "{camera} was calibrated before {field} was changed: "
                            "{changes}.", camera=name, field=field_name, changes=changes_in_words(changes)),
                        FIELD_CHANGED_FIX, reason="field-changed")
    twin = next((other for other in before if other.sent is not None and other.number == one.number), None)
    if twin is not None:
        return Conflict(say("publishing.number-taken", "{camera} and {other} both have camera number {number}.",
                            camera=name, other=twin.name, number=one.number),
                        say("publishing.another-number", "Give {camera} another number.", camera=name),
                        reason="number-taken")
    if not math.isfinite(worst_mm):
        return Conflict(say("publishing.area-not-covered", "The SSL lens model does not cover the whole area of "
                            "{camera}.", camera=name),
                        say("publishing.fit-ssl-model", "Fit the SSL lens model to the same points, and activate the "
                            "new version."), reason="loss-unlimited")
    if worst_mm > config.limit_mm and config.approved.get(name) != one.calibration.id:
        return Conflict(say("publishing.above-limit", "The largest error of the SSL lens model for {camera} is "
                            "{mm:.1f} mm; the limit is {limit_mm:g} mm.", camera=name, mm=worst_mm,
                            limit_mm=config.limit_mm),
                        say("publishing.fit-ssl-model-or-publish", "Fit the SSL lens model to the same points and "
                            "activate the new version, or publish anyway."), reason="loss-above-limit")
    return None
