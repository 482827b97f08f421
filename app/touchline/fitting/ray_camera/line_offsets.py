"""How far the field's lines lie from their places, learned from the picture: one σ for all, more for one far off.

The clicks tell each line's offset o with information S about b (all other unknowns eliminated). With o ~ N(0, D):

    log p(clicks | σ) = -½ log|D| - ½ log|S + D⁻¹| + ½ bᵀ (S + D⁻¹)⁻¹ b,   D = diag(σ² / w)

σ is averaged over its posterior (D. MacKay 1992, "Bayesian interpolation": the evidence). The weights w are those of
Student's t with TAIL degrees of freedom (K. Lange, R. Little, J. Taylor 1989), so that one line painted wrong does
not speak for the others. They are means of the precision given the offset; the variance that stands for how well a line
is known has the mean of the precision's inverse, which is (TAIL + 1) / (TAIL - 1) times as large.
"""

from collections.abc import Sequence

import numpy as np

from touchline.core.geometry import Array, Mask
from touchline.core.json_values import MAX_OFFSET_MM

SIGMAS_MM = np.geomspace(0.05, 30.0, 28)
SIGMA_SPREAD = 0.7  # σ of the logarithm of σ; its mean square is what the field says
TAIL = 4.0
SPREAD = (TAIL + 1) / (TAIL - 1)  # the precision has gamma's distribution
ROUNDS = 4


def line_sigmas_mm(jacobian: Array, columns: Sequence[int], offsets_mm: Array, prior_sigmas_mm: Array,
                   usual_mm: float, kind: Mask) -> Array:
    """Return σ (n,) mm of each line's offset.

    jacobian: (rows, parameters) of whitened residuals at their minimum, with the offsets' priors in it; columns: those
    of the offsets. offsets_mm, prior_sigmas_mm (n,): at that minimum. kind (n,): which share one σ. Lines that are
    straight may well lie beside their places: tilts must not speak for offsets.
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
    usual_mm = usual_mm / np.sqrt(SPREAD)  # so that a line of which nothing is known has what the field says
    weights, sigma = np.ones(len(lines)), np.full(len(lines), usual_mm)
    for _ in range(ROUNDS):
        for one in np.unique(kind):
            sigma[kind == one] = _posterior_sigma(schur + np.diag(np.where(kind == one, 0.0, weights / sigma**2)), pull,
                                                  weights, kind == one, usual_mm)
        posterior = np.linalg.inv(schur + np.diag(weights / sigma**2))
        second_moment = np.minimum((posterior @ pull) ** 2 + np.diag(posterior), MAX_OFFSET_MM**2)  # or it runs away
        weights = (TAIL + 1) / (TAIL + second_moment / sigma**2)
    return sigma * np.sqrt(SPREAD / weights)


def _posterior_sigma(information: Array, pull: Array, weights: Array, own: Mask, usual_mm: float) -> float:
    """Return the σ that is shared by `own`. information: without what σ says of these, and with the others' precision.

    The others are eliminated. In the eigenvectors of what is left, scaled by the weights, each σ costs one sum.
    """
    others = ~own
    by_others = np.linalg.solve(information[np.ix_(others, others)], information[np.ix_(others, own)]).T
    left = information[np.ix_(own, own)] - by_others @ information[np.ix_(others, own)]
    root = np.sqrt(weights[own])
    values, vectors = np.linalg.eigh(left / np.outer(root, root))
    pulls = (pull[own] - by_others @ pull[others]) / root @ vectors
    total = np.maximum(values, 0.0) + SIGMAS_MM[:, None] ** -2
    log_p = (0.5 * np.sum(pulls**2 / total - np.log(total * SIGMAS_MM[:, None] ** 2), axis=1)
             - 0.5 * (np.log(SIGMAS_MM / usual_mm) / SIGMA_SPREAD + SIGMA_SPREAD) ** 2)
    p = np.exp(log_p - log_p.max())
    return float(np.sqrt(p @ SIGMAS_MM**2 / p.sum()))
