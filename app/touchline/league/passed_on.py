"""What another publisher says of the field beyond its cameras: its field and ball models, passed on byte for byte.

Ball models and the width of the substitution area are nowhere in Touchline, and a program that hears two fields by
turns starts anew with each: so whoever publishes beside another sends the other's field as it came.
"""

from base64 import b64decode, b64encode
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

from touchline.core.errors import TouchlineError
from touchline.core.field import Field
from touchline.formats.ssl_field import names_are_the_leagues
from touchline.formats.ssl_known_field import known_field
from touchline.league.geometry_listener import RemotePublisher
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket, GeometryParts, GeometryPartsPacket

KEPT_S = 86_400.0  # after a day, what was heard is another event's
SAVED_EVERY_S = 3600.0


@dataclass(frozen=True)
class PassedOn:
    """One sender's newest packet with geometry, as received. heard_at: unix s."""

    address: str
    source: str
    heard_at: float
    packet: bytes

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
        return saved is None or self.heard_at - saved.heard_at > SAVED_EVERY_S or (
            self.field, self.models) != (saved.field, saved.models)

    def to_json(self) -> dict[str, Any]:
        return {"address": self.address, "source": self.source, "heard_at": self.heard_at, "models": bool(self.models)}

    def saved(self) -> dict[str, Any]:
        """Return it as JSON for from_saved()."""
        return {"address": self.address, "source": self.source, "heard_at": self.heard_at,
                "packet": b64encode(self.packet).decode("ascii")}

    @classmethod
    def from_saved(cls, value: Any, now: float) -> Self | None:
        """Read what saved() wrote; None for anything else, and for what is older than a day. now: unix s."""
        try:
            found = cls(str(value["address"])[:64], str(value["source"])[:32], float(value["heard_at"]),
                        b64decode(value["packet"], validate=True))
            return found if decode(GeometryPacket, found.packet).HasField("geometry") and (
                0 <= now - found.heard_at < KEPT_S) else None
        except (TouchlineError, KeyError, TypeError, ValueError):
            return None


def heard_geometry(publishers: Iterable[RemotePublisher], now_s: float, before: PassedOn | None) -> PassedOn | None:
    """Return the geometry to pass on: of the sender as before while it is heard, else the newest; else what was.

    now_s: time.monotonic().
    """
    current = [one for one in publishers if one.is_current(now_s)]
    if not current:
        return before
    same = [one for one in current if before is not None and one.address == before.address]
    newest = max(same or current, key=lambda one: one.geometry_s)
    return PassedOn(newest.address, newest.source_name, newest.geometry_at, newest.data)
