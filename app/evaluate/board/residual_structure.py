"""Whether what a lens leaves over is noise, or has a shape: then the model is wrong, however small the residuals are.

Noise of one corner says nothing of the next one's; the error of a wrong model is nearly the same at both.
"""

import numpy as np

from app.core.geometry import Array
from app.fitting.board.parameters import BoardObservations

SAME_ROW = 1e-3  # of the board's size


def neighbour_correlation(residuals: Array, sights: BoardObservations) -> float:
    """Correlation of the residuals (v, m, 2) of corners that are neighbours in a row: about 0 for noise, towards 1 for
    shape."""
    fine = np.isfinite(residuals).all(axis=-1)
    x, y = sights.places[..., 0], sights.places[..., 1]
    step = SAME_ROW * sights.size_mm
    order = np.lexsort((np.where(fine, x, np.inf), np.where(fine, np.rint(y / step), np.inf)), axis=1)
    r, row, known = (np.take_along_axis(a, order if a.ndim == 2 else order[..., None], axis=1)
                     for a in (residuals, np.rint(y / step), fine))
    pairs = known[:, 1:] & known[:, :-1] & (row[:, 1:] == row[:, :-1])
    if not pairs.any():
        return float("nan")
    first, second = r[:, :-1][pairs], r[:, 1:][pairs]
    power = np.sum(first**2) + np.sum(second**2)
    return float(2 * np.sum(first * second) / power) if power > 0 else 0.0
