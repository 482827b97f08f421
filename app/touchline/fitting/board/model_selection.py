"""Which terms of a lens a board supports: the simplest set that no richer one beats beyond noise."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from touchline.core.geometry import Mask
from touchline.fitting.board.outlier_rejection import BoardSolution
from touchline.models.ray_camera import RayCamera

# Terms of a fraction can hide errors of the board and bend wildly beyond the corners: they must earn a fifth of σ.
RATIONAL_GAIN = 0.2
# What a board may not support is left out; a lens without a choice has one set.
TERM_SETS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "brown-conrady": ((), ("k1",), ("k1", "k2"), ("k1", "k2", "k3"), ("k1", "k2", "p1", "p2", "k3")),
    "fisheye": ((), ("k1",), ("k1", "k2"), ("k1", "k2", "k3", "k4"))}


def term_sets_for(model: type[RayCamera], settings: Mapping[str, Any]) -> tuple[tuple[str, ...], ...]:
    """Return the sets of terms to try, simplest first; one where they are given. A board may support all there are."""
    given = settings.get("terms", "auto")
    if given != "auto":
        return (tuple(given),)
    term_sets = TERM_SETS.get(model.NAME, (model.LENS.TERMS,))
    return term_sets if term_sets[-1] == model.LENS.TERMS else (*term_sets, model.LENS.TERMS)


def select(solutions: Sequence[BoardSolution]) -> int:
    """Return the index of the simplest set that the richer ones, fitted to the same corners, do not beat."""
    best = 0
    for number, richer in enumerate(solutions[1:], 1):
        least_gain = RATIONAL_GAIN if {"k4", "k5", "k6"} <= set(richer.terms) else 0.0
        simple = solutions[best]
        if significantly_better(simple, richer) and richer.sigma_px < (1 - least_gain) * simple.sigma_px:
            best = number
    return best


def significantly_better(simple: BoardSolution, rich: BoardSolution) -> bool:
    """Return whether the extra terms explain more than noise would: a likelihood ratio test at about 1 %.

    The gain is measured against the noise of a corner, and against how much more than that the views scatter as wholes
    (J. Rao, A. Scott 1984): the errors of a finder and of a board come alike to all corners of a view.
    """
    extra = np.array([name not in simple.names for name in rich.names])
    q, freedom = int(extra.sum()), rich.freedom
    if not q or freedom < 1 or not (np.isfinite(rich.minimum.cost) and np.isfinite(rich.minimum.reduced).all()):
        return False
    gain = (simple.minimum.cost - rich.minimum.cost) / q
    views = len(rich.problem.observations.pixels)
    limit = (4 + 3 / q) * (1 + 3 / max(views - q, 1))  # F at about 1 %
    noise = np.sum(rich.minimum.residuals**2) / freedom
    return bool(gain > limit * max(noise, _scatter_of_views(rich, extra)))


def _scatter_of_views(rich: BoardSolution, extra: Mask) -> float:
    """Return what one unknown gains by chance, given how each view alone would move the extra ones."""
    reduced = rich.minimum.reduced
    information = rich.minimum.information + np.diag(rich.prior**2)
    scale = 1 / np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-13, hermitian=True) * np.outer(scale, scale)
    pulls = np.einsum("vij,vi->vj", reduced, rich.minimum.residuals.reshape(len(reduced), -1))
    moves = (pulls @ inverse)[:, extra]  # what each view alone would do to the extra terms
    own = inverse[np.ix_(extra, extra)]
    size = np.sqrt(np.diag(own))
    together = (moves / size).T @ (moves / size) * len(reduced) / max(len(reduced) - 1, 1)
    return float(np.trace(np.linalg.pinv(own / np.outer(size, size), rcond=1e-10, hermitian=True) @ together)
                 / extra.sum())
