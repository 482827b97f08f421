"""Which points are left out together when a fit is checked with points it has not seen.

Lines inside the field, arcs and landmarks are left out whole: only that asks the model for what it does not know. A
border cannot be spared by a model that is made of borders, so borders are cut: into single points for such a model,
into thirds for one with a lens, whose curve must then reach where nobody clicked.
"""

from itertools import chain

import numpy as np

from touchline.core.field import BORDERS
from touchline.core.records import Observations

MAX_FOLDS = 48
THIRDS = 3
WHOLE_FROM = 7  # with so many lines and more, a lens model spares whole borders as well

Fold = list[tuple[int, int]]  # (observation, point)


def folds_for(observations: Observations, used: tuple[bool, ...], *, needs_every_border: bool) -> list[Fold]:
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
            along = about @ np.linalg.svd(about, full_matrices=False)[2][0]  # the direction in which they spread most
            order = [(i, int(k)) for k in np.argsort(along)]
            step = max(1, -(-count // THIRDS))
            folds += [order[k:k + step] for k in range(0, count, step)]
    landmarks = [f for f in folds if observations[f[0][0]].kind == "landmark"]
    if len(landmarks) > MAX_FOLDS // 2:  # many spots: several together, spread by stride
        folds = [f for f in folds if observations[f[0][0]].kind != "landmark"]
        folds += [list(chain(*landmarks[k::MAX_FOLDS // 2])) for k in range(MAX_FOLDS // 2)]
    singles = min(len(border_points), MAX_FOLDS)
    folds += [border_points[k::singles] for k in range(singles)]
    return folds


def whole_lines(observations: Observations, used: tuple[bool, ...], *, needs_every_border: bool) -> set[int]:
    """Return the observations that are left out whole, none of their points left to say where their line lies."""
    rests = [i for i, u in enumerate(used) if u and len(observations[i].points)]
    features = {str(observations[i].feature) for i in rests if observations[i].kind == "line"}
    borders_too = not needs_every_border and len(features) >= WHOLE_FROM
    return {i for i in rests if borders_too or observations[i].feature not in BORDERS}
