"""Distances as somebody with a tape reads them on a field."""

import numpy as np

SIDES_AND_DIAGONALS = (
    ("corner-top-left", "corner-top-right"),
    ("corner-bottom-left", "corner-bottom-right"),
    ("corner-top-left", "corner-bottom-left"),
    ("corner-top-right", "corner-bottom-right"),
    ("corner-top-left", "corner-bottom-right"),
    ("corner-top-right", "corner-bottom-left"),
    ("corner-top-left", "halfway-top"),
    ("corner-bottom-left", "halfway-bottom"),
    ("halfway-top", "halfway-bottom"),
    ("corner-top-left", "defence-left-foot-top"),
    ("corner-bottom-left", "defence-left-foot-bottom"),
    ("corner-top-right", "defence-right-foot-top"),
    ("corner-bottom-right", "defence-right-foot-bottom"),
)


def measured(field, pairs, noise_mm: float = 0.0, seed: int = 0) -> list[tuple[str, str, float]]:
    """(from, to, mm) of each pair of landmarks."""
    random = np.random.default_rng(seed)
    apart = (
        np.subtract(field.landmarks[a].position, field.landmarks[b].position) for a, b in pairs
    )
    return [
        (
            a,
            b,
            float(np.hypot(*gap)) + random.normal(0, noise_mm)
            if noise_mm
            else float(np.hypot(*gap)),
        )
        for (a, b), gap in zip(pairs, apart, strict=True)
    ]
