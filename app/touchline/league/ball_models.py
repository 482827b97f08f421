"""How the ball rolls and hops, as the league's packet says it to teams: entered, measured, or read from a file.

A ball that was kicked slides first and then rolls, each with a deceleration of its own; a chipped one loses a share of
its speed at each hop. Names, units and signs are those of the packet's SSL_GeometryModels.
"""

from dataclasses import asdict, dataclass
from typing import Annotated, ClassVar, Self

from annotated_types import Interval
from pydantic import ConfigDict, Strict

from touchline.core.json_values import JsonObject
from touchline.ssl_protocol.protobuf import encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryModels

Acceleration = Annotated[float, Strict(), Interval(ge=-50, lt=0)]
Share = Annotated[float, Strict(), Interval(ge=0, le=1)]
# a strict dataclass takes no object
READ = ConfigDict(strict=False, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True)
class StraightTwoPhase:
    """acc_slide, acc_roll: m/s², negative. k_switch: at which share of its first speed the ball begins to roll."""

    __pydantic_config__: ClassVar[ConfigDict] = READ
    acc_slide: Acceleration
    acc_roll: Acceleration
    k_switch: Share


@dataclass(frozen=True)
class ChipFixedLoss:
    """Shares of the speed that are left after a hop: along the carpet after the first and later ones, and upwards."""

    __pydantic_config__: ClassVar[ConfigDict] = READ
    damping_xy_first_hop: Share
    damping_xy_other_hops: Share
    damping_z: Share


@dataclass(frozen=True)
class BallModels:
    """What is sent; None: that part is not."""

    __pydantic_config__: ClassVar[ConfigDict] = READ
    straight_two_phase: StraightTwoPhase | None
    chip_fixed_loss: ChipFixedLoss | None

    @property
    def encoded(self) -> bytes:
        return encode(SSL_GeometryModels(**asdict(self)))

    def to_json(self) -> JsonObject:
        return asdict(self)

    @classmethod
    def of(cls, sent: SSL_GeometryModels) -> Self:
        """Return those of a message, whatever their values: they are shown, and checked where they are entered."""
        roll, hop = sent.straight_two_phase, sent.chip_fixed_loss
        return cls(
            StraightTwoPhase(roll.acc_slide, roll.acc_roll, roll.k_switch)
            if sent.HasField("straight_two_phase")
            else None,
            ChipFixedLoss(hop.damping_xy_first_hop, hop.damping_xy_other_hops, hop.damping_z)
            if sent.HasField("chip_fixed_loss")
            else None,
        )
