"""Which terms of a lens a board supports: the simplest set that no richer one beats beyond noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.models.board_solve import Blocks
from app.models.lens import Array
from app.models.rays import RayCamera


def ladder_of(model: type[RayCamera], settings: Mapping[str, Any]) -> tuple[tuple[str, ...], ...]:
    """Sets of terms to try, simplest first; one where they are given. A board may support all there are."""
    given = settings.get("terms", "auto")
    if given != "auto":
        return (tuple(given),)
    ladder = model.term_ladder()
    return ladder if ladder[-1] == model.LENS.TERMS else (*ladder, model.LENS.TERMS)


def chosen_rung(minima: Sequence[Blocks], names: Sequence[tuple[str, ...]], prior: Sequence[Array]) -> int:
    """Index of the simplest rung that the richer ones do not beat. names and prior: of each minimum's free unknowns."""
    best = 0
    for rung in range(1, len(minima)):
        extra = np.array([name not in names[best] for name in names[rung]])
        if extra.any() and needed(minima[rung], extra, names[rung], prior[rung]):
            best = rung
    return best


def needed(minimum: Blocks, extra: Array, names: tuple[str, ...], prior: Array) -> bool:
    """Whether the extra unknowns differ from nought beyond noise: a Wald test at about 1 %.

    Twice: with the covariance that white noise would give, and with one that lets the residuals of a view err together
    (K.-Y. Liang, S. Zeger, 1986), for a finder's and a board's errors do. Both must agree.
    """
    reduced = minimum.reduced
    v, n = len(reduced), reduced.shape[-1]
    information = np.einsum("vij,vik->jk", reduced, reduced, optimize=True) + np.diag(prior**2)
    scale = 1 / np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-13, hermitian=True) * np.outer(scale, scale)
    residuals = minimum.residuals.reshape(v, -1)
    pulls = np.einsum("vij,vi->vj", reduced, residuals)
    together = inverse @ (pulls.T @ pulls) @ inverse * v / max(v - 1, 1)
    q = int(extra.sum())
    terms = minimum.state.shared[[minimum.state.names.index(name) for name in np.array(names)[extra]]]
    corners = int((minimum.residuals != 0).any(axis=-1).sum())
    white = inverse * np.sum(residuals**2) / max(2 * corners - n - 6 * v, 1)
    freedom = max(v - q, 1)
    limit = 4 + 8 / q + 12 / freedom if q < 4 else 3.3 + 12 / freedom  # F at 1 %, near enough
    return all(_wald(terms, covariance[np.ix_(extra, extra)]) / q > limit for covariance in (white, together))


def _wald(values: Array, covariance: Array) -> float:
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return float((values / scale) @ np.linalg.pinv(covariance / np.outer(scale, scale), rcond=1e-10, hermitian=True)
                 @ (values / scale))
