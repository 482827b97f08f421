"""What a venue's colours look like: a few samples of each, from which a lookup table is made anew when it is needed.

name: robocup hall 2
colours:
  orange: [{rgb: [250, 112, 30], spread: 0.02}, …]      at most one sample a click
background: [{rgb: [60, 112, 44], spread: 0.03}, …]     what else there is: carpet, lines, hulls
light: [70.1, 104.9, 66.0]                              the picture's mean when it was learned, as RGB
reach: 3.0                                              how far, in spreads, a colour may be from its samples
margin: 0.7                                             how much nearer it must be than the next one
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NotRequired, Self

from annotated_types import Interval, Len, Predicate
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.json_values import read
from touchline.core.statements import Sentence, named

Bgr = tuple[float, float, float]
MAX_COLOURS = 12
MAX_SAMPLES = 40  # of one colour; five clicks are usual
NAMES = {  # how each colour usually looks (BGR), until it is clicked
    "orange": (30.0, 112.0, 250.0),
    "yellow": (40.0, 214.0, 246.0),
    "blue": (210.0, 96.0, 24.0),
    "pink": (190.0, 92.0, 250.0),
    "green": (92.0, 232.0, 110.0),
    "cyan": (222.0, 214.0, 60.0),
    "purple": (214.0, 52.0, 120.0),
    "red": (44.0, 30.0, 222.0),
}
Level = Annotated[float, Interval(ge=0, le=255)]
Rgb = tuple[Level, Level, Level]


class ColourSampleJson(TypedDict):
    rgb: list[float]
    spread: float


class ProfileJson(TypedDict):
    name: str
    colours: dict[str, list[ColourSampleJson]]
    background: list[ColourSampleJson]
    light: list[float] | None
    reach: float
    margin: float


class _Sample(TypedDict):
    rgb: Rgb
    spread: NotRequired[Annotated[float, Interval(ge=0, le=1)]]


class _Profile(TypedDict):
    """What may be given as a profile."""

    name: Annotated[str, Len(1, 80), Predicate(str.isprintable)]
    colours: Annotated[
        dict[str, Annotated[list[_Sample], Len(1, MAX_SAMPLES)]], Len(1, MAX_COLOURS)
    ]
    background: NotRequired[Annotated[list[_Sample], Len(0, MAX_SAMPLES)] | None]
    light: NotRequired[Rgb | None]
    reach: NotRequired[Annotated[float, Interval(ge=0.5, le=20)]]
    margin: NotRequired[Annotated[float, Interval(ge=0, le=10)]]


@dataclass(frozen=True)
class ColourSample:
    """A colour as it was seen, and how much it varied there: standard deviation of its chroma."""

    bgr: Bgr
    spread: float = 0.0

    def to_json(self) -> ColourSampleJson:
        return {"rgb": [round(v, 1) for v in self.bgr[::-1]], "spread": round(self.spread, 4)}


def colour_name(name: str) -> Sentence:
    """Return what a colour is called within a sentence."""
    return named(f"colour.{name}", name)


@dataclass(frozen=True)
class ColourProfile:
    """Samples by the colour's name. light: mean BGR of the picture they come from, None if not measured."""

    name: str
    colours: Mapping[str, tuple[ColourSample, ...]]
    background: tuple[ColourSample, ...] = ()
    light: Bgr | None = None
    reach: float = 3.0
    margin: float = 0.7
    notes: tuple[str, ...] = ()

    def to_json(self) -> ProfileJson:
        return {
            "name": self.name,
            "colours": {
                name: [s.to_json() for s in samples] for name, samples in self.colours.items()
            },
            "background": [s.to_json() for s in self.background],
            "light": None if self.light is None else [round(v, 2) for v in self.light[::-1]],
            "reach": self.reach,
            "margin": self.margin,
        }

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read a profile written by to_json or by hand; BadInput for anything else."""
        given = read(
            _Profile,
            value,
            "The colour profile",
            "Give a profile as POST /detections answers it under colours.",
            "bad-colours",
        )
        for colour in given["colours"]:
            if colour not in NAMES:
                raise BadInput(
                    f"Unknown colour: {colour[:40]!r}.",
                    f"Use one of: {', '.join(NAMES)}.",
                    reason="unknown-colour",
                )
        light = given.get("light")
        return cls(
            given["name"],
            {name: _samples(samples) for name, samples in given["colours"].items()},
            _samples(given.get("background") or []),
            light and _bgr(light),
            given.get("reach", 3.0),
            given.get("margin", 0.7),
        )


def _samples(given: list[_Sample]) -> tuple[ColourSample, ...]:
    return tuple(ColourSample(_bgr(sample["rgb"]), sample.get("spread", 0.0)) for sample in given)


def _bgr(rgb: Rgb) -> Bgr:
    return rgb[::-1]
