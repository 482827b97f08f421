"""The model relation: corrected pixels to millimetres, linear across and polynomial down (section III-B, end)."""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from touchline.core.errors import FitFailed
from touchline.core.field import BORDERS, Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array
from touchline.core.records import Observation, Observations
from touchline.core.statements import say
from touchline.models.polynomial import Polynomial

MISTAKE_SHARE = 0.02  # of the field: a known point further off than this was clicked on another mark
MAX_AUTO_DEGREE = 3  # what section III-B used; more follows the clicks

Place = tuple[int, int]  # (observation, point)
_Known = tuple[float, float, int, int]  # share of I_width or I_height, share of the field, and whose


class Relation(NamedTuple):
    """u = across[0] + across[1]·x_c; v = Σ down[k] (y_c / I_height)^k; and how they came about."""

    across_mm: tuple[float, float]
    down_mm: tuple[float, ...]
    notes: dict[str, Any]
    used: tuple[bool, ...]
    outliers: set[Place]


def relate(model: Polynomial, observations: Observations, field: Field, wanted: int | Literal["auto"]) -> Relation:
    """Fit the relation of a model whose borders are fitted.

    Landmarks give both coordinates; a line along or across the region gives one; arcs, slanted lines and points above
    the carpet give none and only check. wanted: the polynomial's degree; "auto" takes what the known rows support.
    """
    region = model.region
    used, across, down = [], [], []  # rows of (corrected, mm, observation, point)
    for i, observation in enumerate(observations):
        if observation.feature in BORDERS:
            used.append(True)
            continue
        feature = field.feature(observation.feature, region)
        knows_u, knows_v, u, v = _known_coordinates(feature, observation, region)
        corrected = model.corrected_from_raw(observation.points)
        for k, (x_c, y_c) in enumerate(corrected):
            if knows_u and np.isfinite(x_c):
                across.append((x_c / model.width_px, u / region.width_mm, i, k))
            if knows_v and np.isfinite(y_c):
                down.append((y_c / model.height_px, v / region.height_mm, i, k))
        used.append(bool((knows_u or knows_v) and observation.z_mm == 0))
    levels = 2 + len({round(row[1], 6) for row in down if 0.02 < row[1] < 0.98})  # the two borders are known rows
    degree = min(MAX_AUTO_DEGREE, levels - 1) if wanted == "auto" else wanted
    if degree > levels - 1:
        raise FitFailed(
            say("refused.relation", "A relation of degree {degree} requires known points at {needed} heights inside "
                                    "the field; there are {n}.", degree=degree, needed=degree - 1, n=levels - 2),
            say("refused.relation.fix", "Mark landmarks or lines across the field, or choose degree 1."),
            reason="too-few-points")
    (a, b), outliers_across = _fit_curve(across, 1)
    down_coefficients, outliers_down = _fit_curve(down, degree)
    slope = polynomial.polyval(np.linspace(0, 1, 64), polynomial.polyder(down_coefficients))
    if not (b > 0 and np.all(slope > 0)):
        raise FitFailed(say("refused.order", "The known points are not in the correct order in the image."),
                        say("refused.order.fix", "Check the landmark or line of each point."), reason="bad-order")
    notes = {"degree": degree, "known_across": len(across), "known_down": len(down),
             "reason": "Only the borders are known: linear in both directions." if not (across or down) else
             f"{len(across)} known columns and {len(down)} known rows inside the field."}
    scale = region.width_mm / model.width_px
    return Relation((float(a * region.width_mm), float(b * scale)),
                    tuple(float(c * region.height_mm) for c in down_coefficients),
                    notes, tuple(used), outliers_across | outliers_down)


def _known_coordinates(feature: Line | Arc | Landmark, observation: Observation,
                       region: Region) -> tuple[bool, bool, float, float]:
    """Return whether a feature fixes u and v of the points on it, and their values."""
    if observation.z_mm != 0 or isinstance(feature, Arc):
        return False, False, 0.0, 0.0
    if isinstance(feature, Landmark):
        u, v = region.region_from_field(np.asarray(feature.position))
        return True, True, float(u), float(v)
    (u0, v0), (u1, v1) = region.region_from_field(np.array([feature.start, feature.end]))
    return abs(u1 - u0) < 1e-6, abs(v1 - v0) < 1e-6, float(u0), float(v0)


def _fit_curve(rows: list[_Known], degree: int) -> tuple[Array, set[Place]]:
    """Fit mm share over pixel share by least squares, the two borders known; return gross mistakes too.

    Each border counts as one point: enough to fix the ends when little else is known, too little to bend the
    relation away from many known points (measured under a strong lens: 25 mm so, 31 mm with heavy borders).
    """
    if not rows:
        return np.pad(np.array([0.0, 1.0]), (0, degree - 1)), set()
    data = np.array([row[:2] for row in rows])
    keep = np.ones(len(rows), bool)
    while True:
        s = np.concatenate([data[keep, 0], [0.0, 1.0]])
        value = np.concatenate([data[keep, 1], [0.0, 1.0]])
        coefficients = np.linalg.lstsq(polynomial.polyvander(s, degree), value, rcond=None)[0]
        error = np.abs(data[:, 1] - polynomial.polyval(data[:, 0], coefficients))
        spread = np.median(error[keep]) if keep.sum() > 3 else 0.0
        worst = np.argmax(np.where(keep, error, -1))
        if error[worst] < max(5 * spread, MISTAKE_SHARE) or keep.sum() <= max(1, 0.75 * len(rows)):
            break
        keep[worst] = False
    return coefficients, {rows[i][2:] for i in np.flatnonzero(~keep)}
