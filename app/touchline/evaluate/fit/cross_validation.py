"""Residuals of points that the fit had not seen: the only ones that say what the next place will be like."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Fit, Observations
from touchline.evaluate.fit.folds import folds_for
from touchline.evaluate.fit.residuals import feature_residuals_mm
from touchline.fitting import FITTERS
from touchline.fitting.clicks import first_of_each_place


def held_out_mm(fit: Fit, observations: Observations, field: Field, region: Region,
                image_size: ImageSize, options: Mapping[str, Any] | None, progress: Progress = no_progress,
                ) -> tuple[NDArray[np.float64], ...]:
    """Leave points out, fit the rest, and measure where the left-out ones land: mm per point.

    Which points go together: folds.py. The choices of the fit (degrees, terms, strays) are kept, so this is the error
    of the curves, not of choosing them. Strays are not measured; points the others cannot predict, and features the
    fit does not rest on, are NaN; so are second clicks on one place, which would be predicted by their twins.
    """
    firsts = [first_of_each_place(o.points) == np.arange(len(o.points)) for o in observations]
    kept = [fine & first for fine, first in zip(fit.inliers, firsts, strict=True)]
    clean = tuple(replace(o, points=o.points[fine]) for o, fine in zip(observations, kept, strict=True))
    result = tuple(np.full(len(o.points), np.nan) for o in observations)
    fitter = FITTERS[fit.model.NAME]
    folds = folds_for(clean, fit.used, needs_every_border=fitter.NEEDS_EVERY_BORDER)
    choices = {**(options or {}), **fit.notes.get("choices", {}), "robust": False}
    for fold, out in enumerate(folds):
        progress(fold / len(folds), "Cross-validating")
        left_out: dict[int, list[int]] = {}  # by observation
        for i, k in out:
            left_out.setdefault(i, []).append(k)
        rest = tuple(replace(o, points=np.delete(o.points, left_out[i], axis=0)) if i in left_out else o
                     for i, o in enumerate(clean))
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
