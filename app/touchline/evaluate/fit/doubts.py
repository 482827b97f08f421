"""What keeps a fit from being called good, whatever its expected error: what contradicts that."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import root_mean_square
from touchline.core.records import Warning
from touchline.evaluate.fit.report_types import Level
from touchline.fitting.ray_camera.height_check import HeightJson

# The best level under a warning, by its reason.
BEST_LEVEL: Mapping[str, Level] = {
    "height-contradicted": "poor", "residuals-too-large": "poor", "unusual-height": "poor",
    "unusual-focal-length": "poor", "unusual-aspect": "fair", "unusual-principal-point": "fair",
    "misplaced-lines": "fair"}
GRID = 9  # places each way over the region


@dataclass(frozen=True)
class Doubt:
    """The best level that it allows, and why. scale_mm: how far positions are off if the field is of another size."""

    level: Level
    why: str
    scale_mm: float = 0.0


def worst_doubt(warnings: Iterable[Warning], height: HeightJson | None, region: Region) -> Doubt | None:
    """Return the warning that caps the level lowest; None where none does."""
    capping = [w for w in warnings if w.reason in BEST_LEVEL]
    if not capping:
        return None
    worst = max(capping, key=lambda w: BEST_LEVEL[w.reason] == "poor")
    return Doubt(BEST_LEVEL[worst.reason], worst.text, scale_error_mm(height, region))


def scale_error_mm(height: HeightJson | None, region: Region) -> float:
    """Return how far positions are off, rms mm, if a contradicted height is right: the field is then so much larger."""
    if height is None or height["state"] != "contradicted" or not height["entered_mm"] or not height["points_mm"]:
        return 0.0
    x, y = np.meshgrid(np.linspace(*region.x_mm, GRID), np.linspace(*region.y_mm, GRID))
    return abs(height["entered_mm"] / height["points_mm"] - 1) * root_mean_square(np.hypot(x, y))
