"""The league's geometry packet: settings of publishing, which cameras are in it, which are not and why, and the field.

A program that hears two different packets by turns starts anew with each: so whoever publishes beside another sends
what the other one sends, byte for byte, with our cameras in place of its own of the same number.
"""

from base64 import b64decode, b64encode
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from dataclasses import field as member
from typing import Any, Self

from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.field import Field
from touchline.core.field_json import FIELD_CHANGED_FIX, changes_in_words, field_from_json
from touchline.core.json_values import JsonObject, read
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.formats.ssl_field import field_to_wire, known_field, names_are_the_leagues
from touchline.league.ball_models import BallModels
from touchline.league.packet_camera import PacketCamera, packet_camera
from touchline.settings import PublishSettings
from touchline.ssl_protocol.protobuf import MAX_BYTES, decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    GeometryPacket,
    GeometryParts,
    GeometryPartsPacket,
    SSL_GeometryCameraCalibration,
    SSL_Source,
)

NO_FIELDS: Mapping[str, Field] = {}
MAX_AGE_S = 86_400.0  # after a day, what was received is another event's
SAVE_EVERY_S = 3600.0


@dataclass(frozen=True)
class PublishingConfig(PublishSettings):
    """All settings of publishing: with those that a page sets, of single cameras by their names.

    field: the field to send where cameras see several; None for that of most cameras. numbers: camera ids, where they
    differ from those of the regions. approved: the cameras that are sent in spite of limit_mm, with the id of the
    calibration for which that was approved. ball_models: what is sent where no other publisher's are.
    """

    field: str | None = None
    ball_models: BallModels | None = None
    numbers: Mapping[str, int] = member(default_factory=dict)
    approved: Mapping[str, str] = member(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, number in self.numbers.items():
            if not 0 <= number < 2**32:
                raise BadInput(
                    say(
                        "publishing.bad-number",
                        "{number} is not a valid camera number for {camera!r}.",
                        number=number,
                        camera=name,
                    ),
                    say("publishing.number-range", "Give a whole number, 0 or more."),
                    reason="bad-camera-number",
                )

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        return read(
            cls,
            value,
            "The network configuration",
            "Enter the network settings again.",
            "bad-publishing",
        )


FitPacketCamera = Callable[[Calibration], PacketCamera | TouchlineError]


@dataclass(frozen=True)
class PublishedCamera:
    """One camera of the packet, or the problem that keeps it out."""

    calibration: Calibration
    number: int
    packet: PacketCamera | None = None
    problem: TouchlineError | None = None

    @property
    def name(self) -> str:
        return self.calibration.camera or self.calibration.id

    @property
    def sent(self) -> SSL_GeometryCameraCalibration | None:
        """The message in the packet; None where the camera is left out."""
        if self.packet is None or self.problem is not None:
            return None
        sent = deepcopy(self.packet.sent)
        sent.camera_id = self.number
        return sent

    def to_json(self) -> JsonObject:
        c, packet = self.calibration, self.packet
        figures = (
            {"exact": False, "loss": None, "level": None, "expected": None, "fit_expected": None}
            if packet is None
            else packet.to_json()
        )
        return {
            "camera": self.name,
            "calibration": c.id,
            "version": c.version,
            "model": c.model_name,
            "field": c.field["name"],
            "region": c.region,
            "camera_id": self.number,
            "published": self.sent is not None,
            **figures,
            "warnings": []
            if packet is None
            else [one.to_json() for one in packet.warnings(self.name)],
            "problem": self.problem and self.problem.to_json(),
        }


@dataclass(frozen=True)
class PassedOn:
    """Another sender's newest packet with geometry, as received, of which field and ball models are passed on.

    heard_at: unix s. cameras: those of it that are passed on as well, in its order, as they came; a sender that is no
    longer received has none.
    """

    address: str
    source: str
    heard_at: float
    packet: bytes
    cameras: tuple[tuple[int, bytes], ...] = ()  # by number

    @property
    def field(self) -> bytes:
        """The field's message."""
        return self._parts.field

    @property
    def models(self) -> bytes:
        """The ball models' message; empty where none was sent."""
        return self._parts.models

    @property
    def _parts(self) -> GeometryParts:
        return decode(GeometryPartsPacket, self.packet).geometry

    def is_of(self, field: Field) -> bool:
        """Tell whether it is that field, under the league's names."""
        sent = decode(GeometryPacket, self.packet).geometry.field
        return known_field(sent, (field,)) is not None and names_are_the_leagues(sent)

    def needs_saving(self, saved: Self | None) -> bool:
        """Tell whether what is saved says something else, or is an hour old."""
        return (
            saved is None
            or self.heard_at - saved.heard_at > SAVE_EVERY_S
            or (self.field, self.models) != (saved.field, saved.models)
        )

    def to_json(self) -> JsonObject:
        return {
            "address": self.address,
            "source": self.source,
            "heard_at": self.heard_at,
            "models": bool(self.models),
            "cameras": [number for number, _ in self.cameras],
        }

    def saved(self) -> JsonObject:
        """Return it as JSON for from_saved()."""
        return {
            "address": self.address,
            "source": self.source,
            "heard_at": self.heard_at,
            "packet": b64encode(self.packet).decode("ascii"),
        }

    @classmethod
    def from_saved(cls, value: Any, now: float) -> Self | None:
        """Read what saved() wrote; None for anything else, and for what is older than a day. now: unix s."""
        try:
            found = cls(
                str(value["address"])[:64],
                str(value["source"])[:32],
                float(value["heard_at"]),
                b64decode(value["packet"], validate=True),
            )
            return (
                found
                if decode(GeometryPacket, found.packet).HasField("geometry")
                and (0 <= now - found.heard_at < MAX_AGE_S)
                else None
            )
        except (TouchlineError, KeyError, TypeError, ValueError):
            return None


def published_cameras(
    calibrations: Sequence[Calibration],
    config: PublishingConfig,
    fit_camera: FitPacketCamera = packet_camera,
    fields: Mapping[str, Field] = NO_FIELDS,
) -> tuple[PublishedCamera, ...]:
    """Return each camera as it would be sent, or why not: its error, number and field are checked.

    fields: as they are now; a calibration made when its field was otherwise is not sent.
    """
    name = _chosen_field(calibrations, config)
    field = fields[name].to_json() if name is not None and name in fields else None
    cameras: list[PublishedCamera] = []
    for calibration in calibrations:
        fitted = fit_camera(calibration)
        if isinstance(fitted, TouchlineError):
            cameras.append(
                PublishedCamera(
                    calibration, config.numbers.get(calibration.camera or "", 0), None, fitted
                )
            )
            continue
        one = PublishedCamera(
            calibration, config.numbers.get(calibration.camera or "", fitted.sent.camera_id), fitted
        )
        cameras.append(
            replace(
                one, problem=_reason_left_out(one, fitted.judged_mm, cameras, config, name, field)
            )
        )
    return tuple(cameras)


def published_field(
    candidates: Iterable[PublishedCamera], fields: Mapping[str, Field] = NO_FIELDS
) -> Field | None:
    """Return the field of the packet, as it is now; None where no camera is sent."""
    sent = [one.calibration for one in candidates if one.sent is not None]
    if not sent:
        return None
    newest = max(sent, key=lambda one: one.created_at).field
    return fields[newest["name"]] if newest["name"] in fields else field_from_json(newest)


def geometry_packet(
    candidates: Sequence[PublishedCamera],
    fields: Mapping[str, Field] = NO_FIELDS,
    passed_on: PassedOn | None = None,
    ball_models: BallModels | None = None,
) -> bytes | None:
    """Encode all cameras that are sent, with their field as it is now; None where there is none.

    passed_on: another publisher's geometry. Where it is of the same field, all of it is sent as it came, but for
    cameras with a number of ours, if a datagram has room for it; else ball_models are sent, our own.
    """
    field = published_field(candidates, fields)
    if field is None:
        return None
    cameras = {one.number: encode(sent) for one in candidates if (sent := one.sent) is not None}
    if passed_on is not None and passed_on.is_of(field):
        cameras = {**dict(passed_on.cameras), **cameras}  # which keeps the order of theirs
        sent_field, models = passed_on.field, passed_on.models
    else:
        sent_field = encode(field_to_wire(field))
        models = b"" if ball_models is None else ball_models.encoded
    parts = GeometryParts(field=sent_field, calib=[*cameras.values()], models=models or None)
    packet = encode(GeometryPartsPacket(geometry=parts, source=SSL_Source.OTHER))
    if passed_on is not None and len(packet) > MAX_BYTES:  # or whoever sends much would silence us
        return geometry_packet(candidates, fields, None, ball_models)
    return packet


def _chosen_field(calibrations: Iterable[Calibration], config: PublishingConfig) -> str | None:
    """Choose the packet's one field: the configured one, else that of most cameras, the first of equals."""
    if config.field is not None:
        return config.field
    names = Counter(calibration.field["name"] for calibration in calibrations)
    return max(names, key=lambda name: names[name], default=None)


def _reason_left_out(
    one: PublishedCamera,
    judged_mm: float,
    before: Iterable[PublishedCamera],
    config: PublishingConfig,
    field_name: str | None,
    field: Mapping[str, Any] | None,
) -> TouchlineError | None:
    """Return why an encoded camera is left out; None where it is sent.

    before: the cameras of the packet so far. field: of that name as it is now, None where it is not known here.
    """
    name = one.name
    if one.calibration.field["name"] != field_name:
        return Conflict(
            say(
                "publishing.other-field",
                "{camera} covers the field {covered}, but a packet has one field: {field}.",
                camera=name,
                covered=one.calibration.field["name"],
                field=field_name,
            ),
            say(
                "publishing.change-field",
                "Publish that field instead, publish the rig of this camera separately, or change its field.",
            ),
            reason="other-field",
        )
    if field is not None and (changes := one.calibration.field_changes(field)):
        return Conflict(
            say(
                "publishing.field-changed",
                "{camera} was calibrated before {field} was changed: {changes}.",
                camera=name,
                field=field_name,
                changes=changes_in_words(changes),
            ),
            FIELD_CHANGED_FIX,
            reason="field-changed",
        )
    same_number = next(
        (other for other in before if other.sent is not None and other.number == one.number), None
    )
    if same_number is not None:
        return Conflict(
            say(
                "publishing.number-taken",
                "{camera} and {other} both have camera number {number}.",
                camera=name,
                other=same_number.name,
                number=one.number,
            ),
            say("publishing.another-number", "Give {camera} another number.", camera=name),
            reason="number-taken",
        )
    if judged_mm > config.limit_mm and name not in config.approved:
        return Conflict(
            say(
                "publishing.above-limit",
                "Teams would receive {camera} with an error of {mm:.0f} mm; you "
                "are asked above {limit_mm:g} mm.",
                camera=name,
                mm=judged_mm,
                limit_mm=config.limit_mm,
            ),
            say(
                "publishing.publish-anyway",
                "Publish it anyway, or use a lens with less distortion or a "
                "smaller area for this camera.",
            ),
            reason="loss-above-limit",
        )
    return None
