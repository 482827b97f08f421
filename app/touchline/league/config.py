"""All settings of publishing and listening: those of the settings file, and what a page sets of single cameras."""

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as member
from typing import Any, Self

from touchline.core.errors import BadInput
from touchline.core.json_values import read
from touchline.core.statements import say
from touchline.settings import PublishSettings


@dataclass(frozen=True)
class PublishingConfig(PublishSettings):
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
