"""Configuration of publishing and listening: everything that an operator can set, as one frozen record."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from dataclasses import field as member
from math import inf
from typing import Any, Self

from touchline.core.errors import BadInput
from touchline.core.reading import read
from touchline.core.statements import say
from touchline.league.multicast_address import GROUP, PORT, MulticastAddress

MIN_INTERVAL_S, MAX_INTERVAL_S = 0.1, 60.0  # between two packets


@dataclass(frozen=True)
class NetworkConfig:
    """What the settings file says. enabled: send geometry. absorb: listen to the group. interval_s: between packets.

    limit_mm: a camera that teams would receive with a larger expected error is sent once that was approved. pass_on:
    send another publisher's field and ball models as they came.
    """

    enabled: bool = False
    absorb: bool = False
    group: str = GROUP
    port: int = PORT
    interface: str = ""
    ttl: int = 1
    interval_s: float = 3.0
    limit_mm: float = 30.0
    pass_on: bool = True

    def __post_init__(self) -> None:
        _ = self.address
        if not MIN_INTERVAL_S <= self.interval_s <= MAX_INTERVAL_S:
            raise BadInput(say("publishing.bad-interval", "{interval_s:g} s is not a valid interval.",
                               interval_s=self.interval_s),
                           say("publishing.interval-range", "Give {least_s:g} to {most_s:g} seconds.",
                               least_s=MIN_INTERVAL_S, most_s=MAX_INTERVAL_S), reason="bad-interval")
        if not 0 <= self.limit_mm < inf:
            raise BadInput(say("publishing.bad-limit", "The limit is not a valid length."),
                           say("publishing.limit-range", "Give millimetres, 0 or more."), reason="bad-limit")

    @property
    def address(self) -> MulticastAddress:
        return MulticastAddress(self.group, self.port, self.interface, self.ttl)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class PublishingConfig(NetworkConfig):
    """All settings of publishing: with those that a page sets, of single cameras by their names.

    field: the field to send where cameras see several; None for that of most cameras. numbers: camera ids, where they
    differ from those of the regions. approved: the cameras that are sent in spite of limit_mm, with the id of the
    calibration for which that was approved.
    """

    field: str | None = None
    numbers: Mapping[str, int] = member(default_factory=dict)
    approved: Mapping[str, str] = member(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, number in self.numbers.items():
            if not 0 <= number < 2**32:
                raise BadInput(say("publishing.bad-number", "{number} is not a valid camera number for {camera!r}.",
                                   number=number, camera=name),
                               say("publishing.number-range", "Give a whole number, 0 or more."),
                               reason="bad-camera-number")

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        return read(cls, value, "The network configuration", "Enter the network settings again.", "bad-publishing")
