"""The disagreement of two cameras as a smooth vector field over the carpet, from what was measured here and there.

    d(p) = Σ c_k q_k(p),   q of degree 0 (one shift), 1 (and a turn, a scale) or 2,   d(p_i) · n_i = offset_i

The lowest degree is taken whose error on points left out is within chance of the least. Stray measures count little
(Tukey's biweight). A weak prior keeps unknown what was not measured: where and in which direction d is known is told by
its covariance, and nothing else is drawn.
"""

from dataclasses import dataclass

import numpy as np

from app.evaluate.rig_evidence import Evidence
from app.geometry import Points
from app.models.lens import Array

PRIOR_MM = 300.0  # nobody's cameras are further apart
LEAST_ROWS = (1, 10, 20)  # of degree 0, 1 and 2
WITHIN_CHANCE = 1.1
NOISE_MM = 0.3  # the least that a measure may claim
KNOWN_MM = 5.0  # one standard deviation: a worse known disagreement is not known
KNOWN_SHARE = 0.3  # of the disagreement itself, where that is large
CUT = 4.7  # Tukey's, times the scale
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Offsets:
    """d(p). coefficients (2 k,), covariance (2 k, 2 k); good (n,): measures that were believed."""

    middle: Array
    scale_mm: float
    degree: int
    coefficients: Array
    covariance: Array
    good: Array
    residual_mm: float

    def at(self, places: Points) -> tuple[Points, Array]:
        """(…, 2) mm and its covariance (…, 2, 2); NaN where places are."""
        q = _basis((places - self.middle) / self.scale_mm, self.degree)
        k = q.shape[-1]
        blocks = self.covariance.reshape(2, k, 2, k)
        return (np.stack([q @ self.coefficients[:k], q @ self.coefficients[k:]], axis=-1),
                np.einsum("...k,akbl,...l->...ab", q, blocks, q))

    def known_mm(self, places: Points) -> tuple[Array, Array]:
        """(…,) mm: how far apart, as far as it is known, NaN where not; and in how many directions it is, 0 to 2."""
        offset, covariance = self.at(places)
        fine = np.isfinite(covariance).all(axis=(-2, -1))
        values, vectors = np.linalg.eigh(np.where(fine[..., None, None], covariance, np.eye(2)))
        along = np.einsum("...ab,...a->...b", vectors, np.nan_to_num(offset))
        known = (np.sqrt(values) <= np.maximum(KNOWN_MM, KNOWN_SHARE * np.abs(along))) & fine[..., None]
        known &= np.sqrt(values) < PRIOR_MM / 10
        count = known.sum(axis=-1)
        return np.where(count > 0, np.sqrt(np.sum(np.where(known, along, 0.0) ** 2, axis=-1)), np.nan), count


def offsets(evidence: Evidence) -> Offsets:
    """The smooth field that the evidence tells."""
    middle = evidence.places.mean(axis=0)
    scale = max(float(np.linalg.norm(evidence.places - middle, axis=1).max()), 1.0)
    at = (evidence.places - middle) / scale
    tried = [_fitted(at, evidence, degree) for degree, least in enumerate(LEAST_ROWS) if len(evidence) >= least]
    least = min(error for error, *_ in tried)
    degree = next(d for d, (error, *_) in enumerate(tried) if error <= WITHIN_CHANCE * least + NOISE_MM / 2)
    _, coefficients, covariance, good, residual = tried[degree]
    return Offsets(middle, scale, degree, coefficients, covariance, good, residual)


def _basis(at: Points, degree: int) -> Array:
    x, y = at[..., 0], at[..., 1]
    return np.stack([np.ones_like(x), *((x, y) if degree > 0 else ()), *((x * x, x * y, y * y) if degree > 1 else ())],
                    axis=-1)


def _fitted(at: Points, evidence: Evidence, degree: int) -> tuple[float, Array, Array, Array, float]:
    """(error on points left out, coefficients, covariance, good, rms residual), mm."""
    q = _basis(at, degree)
    rows = np.concatenate([q * evidence.normals[:, :1], q * evidence.normals[:, 1:]], axis=1)
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
    error = float(np.sqrt(np.mean(np.minimum(out, CUT * scale) ** 2)))
    return error, found, covariance, good, float(np.sqrt(np.mean(residual[good] ** 2))) if good.any() else error
