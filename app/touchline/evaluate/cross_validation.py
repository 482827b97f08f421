"""Residuals of points that the fit had not seen: the only ones that say what the next place will be like.

Lines inside the field, arcs and landmarks are left out whole: only that asks the model for what it does not know. A
border cannot be spared by a model that is made of borders, so borders are cut: into single points for such a model,
into thirds for one with a lens, whose curve must then reach where nobody clicked.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import FitFailed
from touchline.core.field import BORDERS, Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Fit, Observations
from touchline.evaluate.residuals import feature_residuals_mm
from touchline.fitting import FITTERS
from touchline.fitting.contract import first_of_each_place

MAX_FOLDS = 48
THIRDS = 3
WHOLE_FROM = 7  # with so many lines and more, a lens model spares whole borders as well

Fold = list[tuple[int, int]]  # (observation, point)


def folds_for(
    observations: Observations, used: tuple[bool, ...], *, needs_every_border: bool
) -> list[Fold]:
    """All folds; together they hold every point the fit rests on."""
    rests = [i for i, u in enumerate(used) if u and len(observations[i].points)]
    spared = whole_lines(observations, used, needs_every_border=needs_every_border)
    folds: list[Fold] = []
    border_points: Fold = []
    for i in rests:
        count = len(observations[i].points)
        whole = [(i, k) for k in range(count)]
        if i in spared:
            folds.append(whole)
        elif needs_every_border:
            border_points += whole
        else:
            about = observations[i].points - observations[i].points.mean(axis=0)
            # the direction in which they spread most
            along = about @ np.linalg.svd(about, full_matrices=False)[2][0]
            order = [(i, int(k)) for k in np.argsort(along)]
            step = max(1, -(-count // THIRDS))
            folds += [order[k : k + step] for k in range(0, count, step)]
    landmarks = [f for f in folds if observations[f[0][0]].kind == "landmark"]
    if len(landmarks) > MAX_FOLDS // 2:  # many spots: several together, spread by stride
        folds = [f for f in folds if observations[f[0][0]].kind != "landmark"]
        folds += [list(chain(*landmarks[k :: MAX_FOLDS // 2])) for k in range(MAX_FOLDS // 2)]
    singles = min(len(border_points), MAX_FOLDS)
    folds += [border_points[k::singles] for k in range(singles)]
    return folds


def whole_lines(
    observations: Observations, used: tuple[bool, ...], *, needs_every_border: bool
) -> set[int]:
    """Return the observations that are left out whole, none of their points left to say where their line lies."""
    rests = [i for i, u in enumerate(used) if u and len(observations[i].points)]
    features = {str(observations[i].feature) for i in rests if observations[i].kind == "line"}
    borders_too = not needs_every_border and len(features) >= WHOLE_FROM
    return {i for i in rests if borders_too or observations[i].feature not in BORDERS}


def held_out_mm(
    fit: Fit,
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    options: Mapping[str, Any] | None,
    progress: Progress = no_progress,
) -> tuple[NDArray[np.float64], ...]:
    """Leave points out, fit the rest, and measure where the left-out ones land: mm per point.

    The choices of the fit (degrees, terms, strays) are kept, so this is the error
    of the curves, not of choosing them. Strays are not measured; points the others cannot predict, and features the
    fit does not rest on, are NaN; so are second clicks on one place, which would be predicted by their twins.
    """
    firsts = [first_of_each_place(o.points) == np.arange(len(o.points)) for o in observations]
    kept = [fine & first for fine, first in zip(fit.inliers, firsts, strict=True)]
    clean = tuple(
        replace(o, points=o.points[fine]) for o, fine in zip(observations, kept, strict=True)
    )
    result = tuple(np.full(len(o.points), np.nan) for o in observations)
    fitter = FITTERS[fit.model.NAME]
    folds = folds_for(clean, fit.used, needs_every_border=fitter.NEEDS_EVERY_BORDER)
    choices = {**(options or {}), **fit.notes.get("choices", {}), "robust": False}
    for fold, out in enumerate(folds):
        progress(fold / len(folds), "Cross-validating")
        left_out: dict[int, list[int]] = {}  # by observation
        for i, k in out:
            left_out.setdefault(i, []).append(k)
        rest = tuple(
            replace(o, points=np.delete(o.points, left_out[i], axis=0)) if i in left_out else o
            for i, o in enumerate(clean)
        )
        try:
            without = fitter.fit(rest, field, region, image_size, choices)
        except FitFailed:
            continue
        painted = field.as_painted(without.notes, region)
        for i, ks in left_out.items():
            original = np.flatnonzero(kept[i])[ks]  # clean counts without the strays
            held_out = replace(clean[i], points=clean[i].points[ks])
            result[i][original] = feature_residuals_mm(without.model, held_out, painted, region)
    return result
