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
from math import isfinite
from typing import Any, Self

from typing_extensions import TypedDict

from app.core.errors import BadInput
from app.core.statements import Sentence, named

Bgr = tuple[float, float, float]
MAX_COLOURS = 12
MAX_SAMPLES = 40  # of one colour; five clicks are usual
NAMES = {  # how each colour usually looks (BGR), until it is clicked
    "orange": (30.0, 112.0, 250.0), "yellow": (40.0, 214.0, 246.0), "blue": (210.0, 96.0, 24.0),
    "pink": (190.0, 92.0, 250.0), "green": (92.0, 232.0, 110.0), "cyan": (222.0, 214.0, 60.0),
    "purple": (214.0, 52.0, 120.0), "red": (44.0, 30.0, 222.0)}
_FORM = "Give a profile that touchline detect --save-colours wrote."


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
        return {"name": self.name, "colours": {name: [s.to_json() for s in samples]
                                               for name, samples in self.colours.items()},
                "background": [s.to_json() for s in self.background],
                "light": None if self.light is None else [round(v, 2) for v in self.light[::-1]],
                "reach": self.reach, "margin": self.margin}

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read a profile written by to_json or by hand; BadInput for anything else."""
        known = {"name", "colours", "background", "light", "reach", "margin"}
        if not isinstance(value, Mapping) or not {"name", "colours"} <= set(value) <= known:
            raise _refused("This is not a colour profile.")
        name, colours = value["name"], value["colours"]
        if not isinstance(name, str) or not 0 < len(name) <= 80 or not name.isprintable():
            raise _refused("The colour profile has no name.")
        if not isinstance(colours, Mapping) or not 0 < len(colours) <= MAX_COLOURS:
            raise _refused("The colour profile has no colours.")
        for colour in colours:
            if colour not in NAMES:
                raise BadInput(f"Unknown colour: {str(colour)[:40]!r}.",
                               f"Use one of: {', '.join(NAMES)}.", reason="unknown-colour")
        light = value.get("light")
        return cls(name, {colour: _samples(samples, colour) for colour, samples in colours.items()},
                   _samples(value.get("background") or [], "background"), None if light is None else _bgr(light),
                   _number(value.get("reach", 3.0), 0.5, 20), _number(value.get("margin", 0.7), 0, 10))


def _samples(value: Any, colour: str) -> tuple[ColourSample, ...]:
    if not isinstance(value, (list, tuple)) or len(value) > MAX_SAMPLES or (not value and colour != "background"):
        raise _refused(f"The colour {colour} has no samples, or more than {MAX_SAMPLES}.")
    found = []
    for sample in value:
        if not isinstance(sample, Mapping) or not {"rgb"} <= set(sample) <= {"rgb", "spread"}:
            raise _refused(f"A sample of {colour} is invalid.")
        found.append(ColourSample(_bgr(sample["rgb"]), _number(sample.get("spread", 0.0), 0, 1)))
    return tuple(found)


def _bgr(value: Any) -> Bgr:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise _refused("A colour must be three numbers.")
    r, g, b = (_number(v, 0, 255) for v in value)
    return b, g, r


def _number(value: Any, low: float, high: float) -> float:
    if type(value) not in (int, float) or not isfinite(value) or not low <= value <= high:
        raise _refused(f"{str(value)[:40]!r} is not a number from {low:g} to {high:g}.")
    return float(value)


def _refused(what: str) -> BadInput:
    return BadInput(what, _FORM, reason="bad-colours")
