"""A bow that all edges share: ropes that sag, boards that bend. It is the edges' own, and no lens's.

A lens bows an edge away from its middle, or towards it, so edges on both sides of the middle bow in opposite ways:

    bow of edge i, px, along its normal n  =  Σ_j term_j · ∂bow_i/∂term_j  +  length_i · (n_i · share)

share (2,): by how much of its length the middle of every edge is displaced in the picture. Without it a fit puts the
lens's middle beyond the edges, or leaves those of one side out as not straight; with it they become straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Points
from touchline.fitting.plumb_line.fit import PlumbLineFit, fit_plumb_lines
from touchline.fitting.plumb_line.line_sag import SagVerdict, sag_vectors
from touchline.fitting.plumb_line.search import PlumbLineProblem
from touchline.models.distortion import Distortion

REWEIGHTS = 20
SIGMAS = 5.0
# Of the misfit without it, after a second round; the first, whose share a strong lens makes rough, must be no worse.
MUCH_STRAIGHTER = 0.85  # honest lenses become at most 3 % straighter by it, whatever their centre and their terms
FAR_CENTRE = 6.0  # times its σ, the lens's middle lies beside the picture's: then being as straight is enough
AS_STRAIGHT, EASED = 1.05, 1.2
OPPOSITE = -0.5  # cosine of bows that point apart
MIN_NOISE_PX = 0.1
TERM_STEP = 1e-3


@dataclass(frozen=True, eq=False)
class CommonBow:
    """share (2,): displacement of the middle of every edge, x and y of the picture, of its length; its σ."""

    share: Array
    sigma: Array

    @property
    def axis(self) -> int:
        """Return the direction in which it stands out most: 0 across the picture, 1 down."""
        return int(np.argmax(np.abs(self.share) / self.sigma))


def common_bow(fit: PlumbLineFit, verdict: SagVerdict, chains: Sequence[Points], *,
               centre_sigma_px: float | None = None) -> CommonBow | None:
    """Return the bow that the edges share, if it explains them better than the lens alone; None otherwise.

    chains and centre_sigma_px as fit_plumb_lines took them.
    """
    given = [np.asarray(chain, float) for chain in chains]
    edges = {c.index: _Edge.of(given[c.index]) for c in fit.chains if np.isfinite(c.before_px)}
    lens = replace(fit.lens, centre_px=fit.lens.image_size.centre)
    names = [name for name in fit.names if not name.startswith("centre")]
    usual_px = PlumbLineProblem.of(fit.lens.name, None, centre_sigma_px, fit.lens.image_size).centre_sigma
    far = np.abs(np.subtract(fit.lens.centre_px, fit.lens.image_size.centre)).max() > FAR_CENTRE * usual_px
    least = verdict.noise_px / max(edge.length_px for edge in edges.values())
    share, pictures = np.zeros(2), [c.picture for c in fit.chains]
    for straighter in ((EASED, AS_STRAIGHT) if far else (1.0, MUCH_STRAIGHTER)):
        step, sigma = _share(lens, names, [edge.without(share) for edge in edges.values()])
        share = share + step
        if not (np.abs(share) > np.maximum(SIGMAS * sigma, least)).any():
            return None
        straightened = [edges[i].without(share).points if i in edges else chain for i, chain in enumerate(given)]
        try:
            better = fit_plumb_lines(straightened, fit.lens.image_size, fit.lens.name, pictures=pictures,
                                     centre_sigma_px=centre_sigma_px)
        except FitFailed:
            return None
        if better.misfit > straighter * fit.misfit:
            return None
        lens = better.lens
    return CommonBow(share, sigma)


def both_sides_seen(fit: PlumbLineFit, verdict: SagVerdict, chains: Sequence[Points]) -> bool:
    """Whether the lens bows two of the edges in opposite ways, both visibly: what no bow of their own does."""
    vectors = sag_vectors(fit, chains)
    lengths = np.linalg.norm(vectors, axis=1)
    seen = lengths > verdict.noise_px / 2
    if not seen.any():
        return False
    directions = vectors[seen] / lengths[seen, None]
    return bool((directions @ directions.T).min() < OPPOSITE)


@dataclass(frozen=True, eq=False)
class _Edge:
    """Points (n, 2); their normal; 1 - u² (n,), u from -1 to 1 along; length."""

    points: Points
    normal: Array
    shape: Array
    length_px: float

    @classmethod
    def of(cls, points: Points) -> "_Edge":
        normal, along = _across_and_along(points)
        return cls(points, normal, 1 - along**2, float(np.linalg.norm(np.ptp(points, axis=0))))

    def without(self, share: Array) -> "_Edge":
        return replace(self, points=self.points - np.outer(self.shape, self.normal) * self.length_px
                       * float(self.normal @ share))


def _share(lens: Distortion, names: list[str], edges: list[_Edge]) -> tuple[Array, Array]:
    """Return the share (2,) that the bows left by this lens ask for, and its σ; terms may move as well."""
    left = _bows(lens, edges)
    moved = []
    for name in names:
        terms = np.array(lens.terms)
        terms[lens.lens.TERMS.index(name)] += TERM_STEP
        moved.append((_bows(replace(lens, terms=tuple(terms.tolist())), edges) - left) / TERM_STEP)
    rows = np.stack([*moved, *np.transpose([edge.normal * edge.length_px for edge in edges])], axis=1)
    fine = np.isfinite(left) & np.isfinite(rows).all(axis=1)
    rows, left = rows[fine], left[fine]
    weight = np.ones(len(left))
    noise = MIN_NOISE_PX
    for _ in range(REWEIGHTS):  # edges that are crooked in a way of their own hardly count
        root = np.sqrt(weight)
        off = left - rows @ np.linalg.lstsq(rows * root[:, None], left * root, rcond=1e-9)[0]
        noise = max(1.4826 * float(np.median(np.abs(off))), MIN_NOISE_PX)
        weight = 1 / (1 + (off / (2 * noise)) ** 2)
    normal = rows.T @ (rows * weight[:, None])
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    values = inverse @ rows.T @ (weight * left)
    return values[len(names):], np.sqrt(np.diag(inverse))[len(names):] * noise


def _bows(lens: Distortion, edges: list[_Edge]) -> Array:
    """Return how far the middle of each edge (e,) lies off its ends along its normal once the lens is undone, px."""
    bows = []
    for edge in edges:
        points = lens.undistorted_from_raw(edge.points)
        if not np.isfinite(points).all():
            bows.append(np.nan)
            continue
        normal, along = _across_and_along(points)
        side = 1.0 if normal @ edge.normal >= 0 else -1.0
        bows.append(-side * float(np.polyfit(along, points @ normal, 2)[0]))
    return np.array(bows)


def _across_and_along(points: Points) -> tuple[Array, Array]:
    about = points - points.mean(axis=0)
    direction = np.linalg.svd(about, full_matrices=False)[2][0]
    along = about @ direction
    low, high = along.min(), along.max()
    return np.array([-direction[1], direction[0]]), 2 * (along - low) / max(high - low, 1e-9) - 1
