"""How well a profile's colours can be told apart, in words."""

from dataclasses import dataclass

import numpy as np

from app.core.colour_profile import ColourProfile
from app.vision.colour.table import distances, features

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
        return {**vars(self), "gap": self.gap if np.isfinite(self.gap) else None}


def colour_health(profile: ColourProfile) -> tuple[ColourSeparation, ...]:
    others = {**profile.colours, "the background": profile.background}
    found = []
    for colour, samples in profile.colours.items():
        chroma = features(np.array([s.bgr for s in samples]))
        gaps = {name: float(distances(chroma, rest, burnt=False).min()) for name, rest in others.items()
                if name != colour and rest}
        nearest = min(gaps, key=gaps.get, default=None)
        gap = gaps[nearest] if nearest else float("inf")
        level = "good" if gap >= _APART else "close" if gap >= _CLOSE else "mixed"
        words = {"good": "is well separated.",
                 "close": f"is close to {nearest}. Add samples of both where the light differs.",
                 "mixed": f"overlaps with {nearest}. Change the light, the white balance or the paper."}[level]
        found.append(ColourSeparation(colour, nearest if np.isfinite(gap) else None, gap, level,
                                      f"{colour.capitalize()} {words}"))
    return tuple(found)
