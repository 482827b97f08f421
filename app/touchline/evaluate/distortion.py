"""How far a border bows from straight: the paper's measure of distortion, signed.

    distortion = (k2 - k0) / k0 · 100 %                                                   # Eq. (9)

k0 is the ideal distance, here the length of the straight chord between the border's ends; k2 - k0 is how far the
observed border departs from it at its worst place, counted inwards. So a border that bows outwards, away from the
middle of the field, is negative: barrel; one that bows inwards is positive: pincushion. A standard lens stays within
±3 %. What it cannot see: a distortion that leaves borders straight, such as a wrong aspect, and all that lies inside.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.polynomial import polynomial

from touchline.core.field import BORDERS, Region
from touchline.core.geometry import Points
from touchline.evaluate.report_types import DistortionReport, Sag
from touchline.models import CameraModel, raw_from_field

STANDARD_LENS_PCT = 3.0  # section IV
# a quarter of a pixel in 170: what careful clicks cannot tell from straight
NO_DISTORTION_PCT = 0.15
SAMPLES = 201

Kind = Literal["barrel", "pincushion", "none"]


def sag_pct(border: Points, inside: Points) -> float:
    """Eq. (9) of one border: points (n, 2) px from end to end along it, inside (2,) px on the field's side."""
    chord = border[-1] - border[0]
    length = np.hypot(*chord)
    normal = np.array([-chord[1], chord[0]]) / length
    if (inside - border[0]) @ normal < 0:
        normal = -normal
    inwards = (border - border[0]) @ normal
    return float(inwards[np.argmax(np.abs(inwards))] / length * 100)


def distortion_kind(pct: float) -> Kind:
    if abs(pct) < NO_DISTORTION_PCT:
        return "none"
    return "barrel" if pct < 0 else "pincushion"


def clicked_sag_pct(points: Points, run: int, inside: Points) -> float | None:
    """Eq. (9) of clicks themselves, through the parabola that fits them best; for what is left after correction.

    points (n, 2) px, run: the axis they run along (0 x, 1 y). None for fewer than four points.
    """
    points = points[np.isfinite(points).all(axis=-1)]
    if len(points) < 4 or np.ptp(points[:, run]) < 1:
        return None
    middle, extent = points[:, run].mean(), np.ptp(points[:, run])
    design = polynomial.polyvander((points[:, run] - middle) / extent, 2)
    coefficients = np.linalg.lstsq(design, points[:, 1 - run], rcond=None)[0]
    along = np.linspace(points[:, run].min(), points[:, run].max(), SAMPLES)
    across = polynomial.polyval((along - middle) / extent, coefficients)
    return sag_pct(np.stack([along, across] if run == 0 else [across, along], axis=-1), inside)


def distortion_report(
    model: CameraModel, region: Region, clicks: Mapping[str, Points]
) -> DistortionReport:
    """Eq. (9) before and after correction, per border and overall (their mean), as plain JSON.

    clicks: raw px (n, 2) per border, strays left out. Before: the bow of the model's own curve from corner to corner,
    so that it does not depend on where along the border somebody clicked. After: the bow left in the corrected clicks.
    """
    raw = {name: raw_from_field(model, region.border(name).sample(SAMPLES)) for name in BORDERS}
    corrected_middle = model.corrected_from_field(
        region.field_from_region(np.array([region.width_mm / 2, region.height_mm / 2]))
    )
    raw_middle = model.raw_from_corrected(corrected_middle)
    per_border: dict[str, Sag] = {}
    for name in BORDERS:
        before = sag_pct(raw[name], raw_middle) if np.isfinite(raw[name]).all() else None
        corrected = model.corrected_from_raw(clicks.get(name, np.empty((0, 2))))
        after = clicked_sag_pct(corrected, 1 if name in ("left", "right") else 0, corrected_middle)
        per_border[name] = {"before_pct": before, "after_pct": after}
    known = (
        [pct for b in per_border.values() if (pct := b[when]) is not None]
        for when in ("before_pct", "after_pct")
    )
    before, after = (float(np.mean(values)) if values else None for values in known)
    return {
        "before_pct": before,
        "after_pct": after,
        "kind": None if before is None else distortion_kind(before),
        "standard_lens_pct": STANDARD_LENS_PCT,
        "per_border": per_border,
    }
