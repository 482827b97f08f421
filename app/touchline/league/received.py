"""What another publisher sends: its newest geometry, as JSON, and where that contradicts or differs from ours."""

import hashlib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from touchline.core.errors import TouchlineError
from touchline.core.field import Field
from touchline.core.json_values import JsonObject
from touchline.core.statements import Sentence, say, stated
from touchline.formats.ssl_field import field_from_wire, markings_alone
from touchline.formats.ssl_vision import camera_from_wire
from touchline.league.ball_models import BallModels
from touchline.league.packet import PassedOn, PublishedCamera
from touchline.network.listener import RemoteSender
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    GeometryPacket,
    GeometryPartsPacket,
    SSL_GeometryCameraCalibration,
    SSL_GeometryData,
    SSL_GeometryFieldSize,
    SSL_Source,
)

STALE_S = 30.0  # geometry older than this counts no more
DERIVED = (
    "derived_camera_world_tx",
    "derived_camera_world_ty",
    "derived_camera_world_tz",
    "pixel_image_width",
    "pixel_image_height",
)  # of a calibration: they add nothing to it
MARKINGS = ("field_lines", "field_arcs")  # compared by their places
MAX_ROUNDING = 1e-3  # of a float of four bytes
MAX_NAMED = 4  # of what differs; the rest is counted
CameraValues = tuple[tuple[str, object], ...]


@dataclass(frozen=True)
class RemotePublisher(RemoteSender):
    """One sender. data: its newest whole packet with geometry, as received; geometry_s: time.monotonic()."""

    geometries: int = 0
    source: int = 0
    geometry: SSL_GeometryData | None = None
    data: bytes = b""
    geometry_s: float = 0.0
    geometry_at: float = 0.0  # unix s, for people

    @property
    def source_name(self) -> str:
        """SSL_Source in lower case: "ssl-vision"; "unknown" for a number that is not assigned."""
        return (
            SSL_Source.Name(self.source).lower().replace("_", "-")
            if self.source in SSL_Source.values()
            else "unknown"
        )

    def is_current(self, now_s: float) -> bool:
        """Tell whether its geometry counts at now_s, time.monotonic()."""
        return self.geometry is not None and now_s - self.geometry_s <= STALE_S


def received_json(
    publisher: RemotePublisher,
    now_s: float,
    fields: Iterable[Field],
    ours: Iterable[PublishedCamera],
    packet: SSL_GeometryData | None = None,
) -> JsonObject:
    """Describe one publisher at now_s, time.monotonic().

    fields: those known to this server; ours: the cameras that we publish now, in packet.
    """
    geometry = publisher.geometry
    found = {
        "id": publisher.id,
        "address": publisher.address,
        "port": publisher.port,
        "source": publisher.source_name,
        "age_s": round(now_s - publisher.last_s, 3),
        "packets": publisher.packets,
        "geometries": publisher.geometries,
        "refused": publisher.refused,
        "refusal": publisher.refusal or None,
        "skipped": publisher.skipped,
        "geometry_age_s": None,
        "sha256": None,
        "field": None,
        "problem": None,
        "cameras": [],
        "ball_models": None,
        "differs": [],
    }
    if geometry is None:
        return found
    found |= {
        "geometry_age_s": round(now_s - publisher.geometry_s, 3),
        "sha256": hashlib.sha256(publisher.data).hexdigest(),
        "ball_models": BallModels.of(geometry.models).to_json()
        if geometry.HasField("models")
        else None,
    }
    numbers = (
        {one.number: one for one in ours if one.sent is not None}
        if _current_cameras(publisher, now_s)
        else {}
    )
    try:
        fields = tuple(fields)
        field = field_from_wire(geometry.field, fields)
        found["field"] = {
            "name": field.name,
            "title": field.title,
            "length_mm": field.length_mm,
            "width_mm": field.width_mm,
            "known": any(field is one for one in fields),
        }
    except TouchlineError as error:
        return {**found, "problem": error.to_json()}
    differs = () if packet is None else geometry_differences(geometry, packet)
    return {
        **found,
        "differs": [stated({"text": text}) for text in differs],
        "cameras": [
            _camera_json(sent, field, numbers.get(sent.camera_id)) for sent in geometry.calib
        ],
    }


def contradictions(
    publishers: Iterable[RemotePublisher], ours: Iterable[PublishedCamera], now_s: float
) -> list[tuple[RemotePublisher, PublishedCamera]]:
    """Pair each publisher with the camera of ours for whose number it sends another calibration."""
    return [
        (publisher, one)
        for publisher in publishers
        for one in ours
        for sent in _current_cameras(publisher, now_s)
        if one.sent is not None
        and one.number == sent.camera_id
        and sent_values(one) != camera_values(sent)
    ]


def doubled_cameras(
    publishers: Iterable[RemotePublisher], now_s: float
) -> list[tuple[int, RemotePublisher, RemotePublisher]]:
    """List the numbers for which two publishers send different calibrations, each with the first two of them."""
    first: dict[int, tuple[RemotePublisher, CameraValues]] = {}
    found: dict[int, tuple[int, RemotePublisher, RemotePublisher]] = {}
    for publisher in publishers:
        for sent in _current_cameras(publisher, now_s):
            number, values = sent.camera_id, camera_values(sent)
            other, before = first.setdefault(number, (publisher, values))
            if other is not publisher and before != values:
                found.setdefault(number, (number, other, publisher))
    return [*found.values()]


def says_the_same(publisher: RemotePublisher, packet: bytes) -> bool:
    """Whether a program that hears both, its packet and ours, takes them for one."""
    return publisher.geometry == decode(GeometryPacket, packet).geometry


def _current_cameras(
    publisher: RemotePublisher, now_s: float
) -> Sequence[SSL_GeometryCameraCalibration]:
    """Return the cameras of geometry that is not stale."""
    geometry = publisher.geometry
    return geometry.calib if geometry is not None and publisher.is_current(now_s) else ()


def _camera_json(
    sent: SSL_GeometryCameraCalibration, field: Field, ours: PublishedCamera | None
) -> JsonObject:
    found = {
        "camera_id": sent.camera_id,
        "image_size": None,
        "position_mm": None,
        "focal_px": sent.focal_length,
        "distortion": sent.distortion,
        "problem": None,
        "ours": None if ours is None else ours.name,
        "contradicts": ours is not None and sent_values(ours) != camera_values(sent),
    }
    try:
        file = camera_from_wire(sent, field)
    except TouchlineError as error:
        return {**found, "problem": error.to_json()}
    return {
        **found,
        "position_mm": None
        if file.pose is None
        else [round(value, 1) for value in file.pose.position_mm],
        "image_size": None if file.image_size is None else list(file.image_size),
    }


def camera_values(sent: SSL_GeometryCameraCalibration) -> CameraValues:
    """Return a received camera's number and calibration, without what follows from it."""
    return tuple(
        (field.name, value) for field, value in sent.ListFields() if field.name not in DERIVED
    )


def sent_values(one: PublishedCamera) -> CameraValues:
    """Return the same of a camera of ours, as others receive it: in floats of four bytes; () where it is not sent."""
    sent = one.sent
    return () if sent is None else camera_values(decode(type(sent), encode(sent)))


def geometry_to_pass_on(
    publishers: Iterable[RemotePublisher],
    now_s: float,
    before: PassedOn | None,
    sent_cameras: Collection[CameraValues] = (),
) -> PassedOn | None:
    """Return the geometry to pass on: of the sender as before while it sends, else the newest; else what was.

    now_s: time.monotonic(). sent_cameras: all that we have sent; they are not passed on: two programs that did that
    would send each other's removed cameras for ever.
    """
    current = [one for one in publishers if one.is_current(now_s)]
    if not current:
        return before and replace(before, cameras=())
    same = [one for one in current if before is not None and one.address == before.address]
    newest = max(same or current, key=lambda one: one.geometry_s)
    assert newest.geometry is not None  # or it would not be current
    cameras = zip(
        newest.geometry.calib, decode(GeometryPartsPacket, newest.data).geometry.calib, strict=True
    )
    return PassedOn(
        newest.address,
        newest.source_name,
        newest.geometry_at,
        newest.data,
        tuple(
            (sent.camera_id, as_it_came)
            for sent, as_it_came in cameras
            if camera_values(sent) not in sent_cameras
        ),
    )


def geometry_differences(theirs: SSL_GeometryData, ours: SSL_GeometryData) -> list[Sentence]:
    """Say what differs for a program that hears both; nothing where it takes them for one field."""
    length, width = theirs.field.field_length, theirs.field.field_width
    our_length, our_width = ours.field.field_length, ours.field.field_width
    if (length, width) != (our_length, our_width):
        return [
            say(
                "receiving.differs.size",
                "It sends a field of {length} × {width} mm; you send {our_length} × "
                "{our_width} mm.",
                length=length,
                width=width,
                our_length=our_length,
                our_width=our_width,
            )
        ]
    found = []
    only_theirs = say("receiving.differs.theirs", "Only it sends these markings, or at this place:")
    only_ours = say("receiving.differs.ours", "Only you send these markings, or at this place:")
    for words, names in (
        (only_theirs, markings_alone(theirs.field, ours.field)),
        (only_ours, markings_alone(ours.field, theirs.field)),
    ):
        if names:
            found.append(
                say(
                    "receiving.differs.markings",
                    "{words} {names}.",
                    words=words,
                    names=_first_names(names),
                )
            )
    if values := _different_values(theirs.field, ours.field):
        found.append(
            say(
                "receiving.differs.values",
                "Sizes differ (there, here): {values}.",
                values=_first_names(values),
            )
        )
    if theirs.models != ours.models:
        found.append(say("receiving.differs.models", "It sends other ball models than you."))
    numbers, our_numbers = ({camera.camera_id for camera in one.calib} for one in (theirs, ours))
    if missing := sorted(numbers - our_numbers):
        found.append(
            say(
                "receiving.differs.its-cameras",
                "Only it sends the cameras with these numbers: {numbers}.",
                numbers=missing,
            )
        )
    if added := sorted(our_numbers - numbers):
        found.append(
            say(
                "receiving.differs.our-cameras",
                "Only you send the cameras with these numbers: {numbers}.",
                numbers=added,
            )
        )
    return found


def _different_values(theirs: SSL_GeometryFieldSize, ours: SSL_GeometryFieldSize) -> list[str]:
    """List the fields whose numbers differ, by their names on the wire, with both."""
    found = []
    for field in theirs.DESCRIPTOR.fields:
        if field.name not in MARKINGS:
            a, b = (
                getattr(one, field.name) if one.HasField(field.name) else None
                for one in (theirs, ours)
            )
            if a != b and not (a is not None and b is not None and abs(a - b) <= MAX_ROUNDING):
                found.append(f"{field.name} {_number(a)}, {_number(b)}")
    return found


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:g}"


def _first_names(names: list[str]) -> list[str]:
    return names if len(names) <= MAX_NAMED else [*names[:MAX_NAMED], f"… ({len(names)})"]
