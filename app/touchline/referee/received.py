"""What game controllers send: the newest message of each, as JSON, and which one counts."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

from touchline.core.json_values import MAX_NAME, JsonObject
from touchline.network.listener import RemoteSender
from touchline.ssl_protocol.referee_pb2 import RefereeCommand, RefereePacket, RefereeStage

STALE_S = 5.0  # a game controller sends many times a second
KEEP_S = 600.0  # one that is restarted, or unplugged for a moment, has the same teams afterwards


@dataclass(frozen=True)
class RefereeMessage:
    """One message. sent_s: unix; blue_on_positive_half: None where it is not stated; source: of the game controller."""

    sent_s: float
    stage: int
    command: int
    blue: str
    yellow: str
    blue_on_positive_half: bool | None = None
    source: str = ""

    @classmethod
    def of(cls, packet: RefereePacket) -> Self:
        return cls(
            packet.packet_timestamp / 1e6,
            packet.stage,
            packet.command,
            _name(packet.blue.name),
            _name(packet.yellow.name),
            packet.blue_team_on_positive_half
            if packet.HasField("blue_team_on_positive_half")
            else None,
            _name(packet.source_identifier),
        )

    @property
    def stage_name(self) -> str:
        """In lower case: "normal-first-half"; "unknown" for a number that is not assigned."""
        known = self.stage in RefereeStage.values()
        return _spelled(RefereeStage.Name(self.stage)) if known else "unknown"

    @property
    def command_name(self) -> str:
        """In lower case: "force-start"; "unknown" for a number that is not assigned."""
        known = self.command in RefereeCommand.values()
        return _spelled(RefereeCommand.Name(self.command)) if known else "unknown"


@dataclass(frozen=True)
class GameController(RemoteSender):
    """One sender. message: its newest; message_s: when it came, since_s: and the first of those without a gap before
    it, time.monotonic()."""

    message: RefereeMessage | None = None
    message_s: float = 0.0
    since_s: float = 0.0

    def is_current(self, now_s: float) -> bool:
        """Tell whether it sends at now_s, time.monotonic()."""
        return self.message is not None and now_s - self.message_s <= STALE_S

    def to_json(self, now_s: float) -> JsonObject:
        message = self.message
        return {
            "id": self.id,
            "address": self.address,
            "port": self.port,
            "age_s": round(now_s - (self.last_s if message is None else self.message_s), 3),
            "packets": self.packets,
            "refused": self.refused,
            "refusal": self.refusal or None,
            "skipped": self.skipped,
            "current": self.is_current(now_s),
            "stage": message and message.stage_name,
            "command": message and message.command_name,
            "blue": message and message.blue,
            "yellow": message and message.yellow,
            "blue_on_positive_half": message and message.blue_on_positive_half,
        }


def choose(senders: Iterable[GameController], now_s: float) -> GameController | None:
    """Return the one that has sent longest without a gap; where none sends, the last one of some minutes."""
    known = [one for one in senders if one.message and now_s - one.message_s <= KEEP_S]
    current = [one for one in known if one.is_current(now_s)]
    if current:
        return min(current, key=lambda one: one.since_s)
    return max(known, key=lambda one: one.message_s, default=None)


def others(
    senders: Iterable[GameController], chosen: GameController | None, now_s: float
) -> list[GameController]:
    """Return who else sends now; one program by two ways, known by its identifier, is no other."""
    ours = chosen and chosen.message
    return [
        one
        for one in senders
        if one.is_current(now_s)
        and one is not chosen
        and one.message
        and ours
        and (one.message.source != ours.source or not ours.source)
    ]


def _name(text: str) -> str:
    return "".join(one for one in text if one.isprintable()).strip()[:MAX_NAME]


def _spelled(name: str) -> str:
    return name.lower().replace("_", "-")
