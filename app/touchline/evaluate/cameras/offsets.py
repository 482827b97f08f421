"""The disagreement of two cameras as a smooth vector field over the carpet, from what was measured here and there.

    d(p) = Σ c_k q_k(p),   d(p_i) · n_i = offset_i,   q_k the small motions of a plane's picture:

of degree 0 a shift; of degree 1 also a turn and a scale, as of a camera that was turned or raised; of degree 2 also a
stretch, a shear and two tilts: a small homography, 8 in all. Free polynomials would say more than is known: lines tell
of one direction, and what they tell of it must hold for the other one too.

The lowest degree is taken whose error on points left out is within chance of the least. Stray measures count little
(Tukey's biweight). A weak prior keeps unknown what was not measured: where and in which direction d is known is told by
its covariance, and nothing else is drawn.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array, Mask, Points, root_mean_square
from touchline.evaluate.cameras.evidence import OffsetMeasurements

PRIOR_MM = 300.0  # one standard deviation of any disagreement
MIN_MEASURES = (1, 10, 20)  # of degree 0, 1 and 2
WITHIN_CHANCE = 1.1
NOISE_MM = 0.3  # the least that a measure may claim
KNOWN_MM = 5.0  # one standard deviation: a worse known disagreement is not known
KNOWN_SHARE = 0.3  # of the disagreement itself, where that is large
CUT = 4.7  # Tukey's, times the scale
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class OffsetField:
    """d(p). coefficients (k,), covariance (k, k); good (n,): measures that were believed."""

    middle: Array
    scale_mm: float
    degree: int
    coefficients: Array
    covariance: Array
    good: Mask
    residual_mm: float

    def at(self, places: Points) -> tuple[Points, Array]:
        """(…, 2) mm and its covariance (…, 2, 2); NaN where places are."""
        q = _motions((places - self.middle) / self.scale_mm, self.degree)
        return q @ self.coefficients, q @ self.covariance @ np.swapaxes(q, -1, -2)

    def known_mm(self, places: Points) -> tuple[Array, Array]:
        """(…,) mm: how far apart, as far as it is known, NaN where not; and in how many directions it is, 0 to 2."""
        offset, covariance = self.at(places)
        fine = np.all(np.isfinite(covariance), axis=(-2, -1))
        values, vectors = np.linalg.eigh(np.where(fine[..., None, None], covariance, np.eye(2)))
        along = np.einsum("...ab,...a->...b", vectors, np.nan_to_num(offset))
        known = (np.sqrt(values) <= np.maximum(KNOWN_MM, KNOWN_SHARE * np.abs(along))) & fine[..., None]
        known &= np.sqrt(values) < PRIOR_MM / 10
        count = known.sum(axis=-1)
        return np.where(count > 0, np.sqrt(np.sum(np.where(known, along, 0.0) ** 2, axis=-1)), np.nan), count


def fit_offset_field(evidence: OffsetMeasurements) -> OffsetField:
    """Fit the smooth field to the measurements."""
    middle = evidence.places.mean(axis=0)
    scale = max(float(np.linalg.norm(evidence.places - middle, axis=1).max()), 1.0)
    at = (evidence.places - middle) / scale
    tried = [_fitted(at, evidence, degree) for degree, least in enumerate(MIN_MEASURES) if len(evidence) >= least]
    least = min(error for error, *_ in tried)
    degree = next(d for d, (error, *_) in enumerate(tried) if error <= WITHIN_CHANCE * least + NOISE_MM / 2)
    _, coefficients, covariance, good, residual = tried[degree]
    return OffsetField(middle, scale, degree, coefficients, covariance, good, residual)


def _motions(at: Points, degree: int) -> Array:
    """(…, 2, k): the shift of places (…, 2) by each small motion."""
    x, y = at[..., 0], at[..., 1]
    one, none = np.ones_like(x), np.zeros_like(x)
    both = [(one, none), (none, one)]
    if degree > 0:
        both += [(-y, x), (x, y)]
    if degree > 1:
        both += [(x, -y), (y, x), (x * x, x * y), (x * y, y * y)]
    return np.stack([np.stack(pair, axis=-1) for pair in both], axis=-1)


def _fitted(at: Points, evidence: OffsetMeasurements, degree: int) -> tuple[float, Array, Array, Mask, float]:
    """(error on points left out, coefficients, covariance, good, rms residual), mm."""
    rows = np.einsum("nd,ndk->nk", evidence.normals, _motions(at, degree))
    value, n = evidence.offset_mm, len(evidence)
    prior = np.eye(rows.shape[1]) / PRIOR_MM**2
    scale = max(1.4826 * float(np.median(np.abs(value - np.median(value)))), NOISE_MM) if n > 3 else KNOWN_MM / 2
    weight, found, covariance = np.ones(n), np.zeros(rows.shape[1]), prior
    for _ in range(ROUNDS):
        covariance = np.linalg.inv(rows.T @ (rows * (weight / scale**2)[:, None]) + prior)
        found = covariance @ (rows.T @ (weight * value / scale**2))
        residual = value - rows @ found
        free = max(n - rows.shape[1], 1)
        if n > 3:
            scale = max(1.4826 * float(np.median(np.abs(residual))) * np.sqrt(n / free), NOISE_MM)
        weight = np.clip(1 - (residual / (CUT * scale)) ** 2, 0, None) ** 2
    leverage = np.einsum("ij,jk,ik->i", rows, covariance, rows) * weight / scale**2
    out = np.abs(residual) / np.maximum(1 - leverage, 0.05)
    good = weight > 0
    error = root_mean_square(np.minimum(out, CUT * scale))
    return error, found, covariance, good, root_mean_square(residual[good]) if good.any() else error
