"""How well a profile's colours can be told apart, in words."""

from dataclasses import dataclass

import numpy as np

from touchline.core.colour_profile import ColourProfile, colour_name
from touchline.core.statements import Sentence, capitalised, say, stated
from touchline.vision.colour.table import distances, features

BACKGROUND = "the background"  # beside the colours
_APART, _CLOSE = 4.0, 2.0  # spreads between two colours


@dataclass(frozen=True)
class ColourSeparation:
    """One colour beside the nearest other. gap: in spreads; infinite where nothing is near."""

    colour: str
    nearest: str | None
    gap: float
    level: str  # "good", "close" or "mixed"
    sentence: str

    def to_json(self) -> dict:
        return stated({**vars(self), "gap": self.gap if np.isfinite(self.gap) else None})


def colour_health(profile: ColourProfile) -> tuple[ColourSeparation, ...]:
    others = {**profile.colours, BACKGROUND: profile.background}
    found = []
    for colour, samples in profile.colours.items():
        chroma = features(np.array([s.bgr for s in samples]))
        gaps = {name: float(distances(chroma, rest, burnt=False).min()) for name, rest in others.items()
                if name != colour and rest}
        nearest = min(gaps, key=gaps.__getitem__, default=None)
        gap = gaps[nearest] if nearest else float("inf")
        level = "good" if gap >= _APART else "close" if gap >= _CLOSE else "mixed"
        found.append(ColourSeparation(colour, nearest if np.isfinite(gap) else None, gap, level,
                                      _sentence(level, colour, nearest)))
    return tuple(found)


def _sentence(level: str, colour: str, nearest: str | None) -> Sentence:
    first = capitalised(_name(colour))
    if level == "good" or nearest is None:
        return say("colour-separation.good", "{colour} is well separated.", colour=first)
    if level == "close":
        return say("colour-separation.close", "{colour} is close to {nearest}. Add samples of both where the light "
                   "differs.", colour=first, nearest=_name(nearest))
    return say("colour-separation.mixed", "{colour} overlaps with {nearest}. Change the light, the white balance or "
               "the paper.", colour=first, nearest=_name(nearest))


def _name(colour: str) -> str:
    """Return what a colour or the background is called within a sentence."""
    return say("colour.background", BACKGROUND) if colour == BACKGROUND else colour_name(colour)
