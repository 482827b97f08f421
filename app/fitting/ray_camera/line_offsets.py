"""How far the field's lines lie from their places, learned from the picture: one σ for all, more for one far off.

The clicks tell each line's offset o with information S about b (all other unknowns eliminated). With o ~ N(0, D):

    log p(clicks | σ) = -½ log|D| - ½ log|S + D⁻¹| + ½ bᵀ (S + D⁻¹)⁻¹ b,   D = diag(σ² / w)

σ is averaged over its posterior (D. MacKay 1992, "Bayesian interpolation": the evidence). The weights w are those of
Student's t with TAIL degrees of freedom (K. Lange, R. Little, J. Taylor 1989), so that one line painted wrong does
not speak for the others.
"""

from collections.abc import Sequence

import numpy as np

from app.core.geometry import Array

SIGMAS_MM = np.geomspace(0.05, 30.0, 28)
SIGMA_SPREAD = 0.7  # σ of the logarithm of σ; its mean square is what the field says
TAIL = 4.0
ROUNDS = 4


def line_sigmas_mm(jacobian: Array, columns: Sequence[int], offsets_mm: Array, prior_sigmas_mm: Array,
                   usual_mm: float) -> Array:
    """Return σ (n,) mm of each line's offset.

    jacobian: (rows, parameters) of whitened residuals at their minimum, with the offsets' priors in it; columns: those
    of the offsets. offsets_mm, prior_sigmas_mm (n,): at that minimum.
    """
    lines = np.asarray(columns)
    others = np.setdiff1d(np.arange(jacobian.shape[1]), lines)
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    information = (jacobian / scale).T @ (jacobian / scale)
    by_others = information[np.ix_(lines, others)]
    schur = information[np.ix_(lines, lines)] - by_others @ np.linalg.pinv(
        information[np.ix_(others, others)], rcond=1e-12, hermitian=True) @ by_others.T
    schur = schur * np.outer(scale[lines], scale[lines]) - np.diag(prior_sigmas_mm**-2.0)
    values, vectors = np.linalg.eigh((schur + schur.T) / 2)
    schur = (vectors * np.maximum(values, 0)) @ vectors.T  # rounding must not make information negative
    pull = schur @ offsets_mm + offsets_mm / prior_sigmas_mm**2
    weights = np.ones(len(lines))
    sigma = usual_mm
    for _ in range(ROUNDS):
        sigma = _posterior_sigma(schur, pull, weights, usual_mm)
        posterior = np.linalg.inv(schur + np.diag(weights / sigma**2))
        second_moment = (posterior @ pull) ** 2 + np.diag(posterior)
        weights = (TAIL + 1) / (TAIL + second_moment / sigma**2)
    return sigma / np.sqrt(weights)


def _posterior_sigma(schur: Array, pull: Array, weights: Array, usual_mm: float) -> float:
    log_p = []
    for sigma in SIGMAS_MM:
        precision = weights / sigma**2
        total = schur + np.diag(precision)
        log_p.append(0.5 * np.sum(np.log(precision)) - 0.5 * np.linalg.slogdet(total)[1]
                     + 0.5 * pull @ np.linalg.solve(total, pull)
                     - 0.5 * (np.log(sigma / usual_mm) / SIGMA_SPREAD + SIGMA_SPREAD) ** 2)
    p = np.exp(np.array(log_p) - max(log_p))
    return float(np.sqrt(p @ SIGMAS_MM**2 / p.sum()))
