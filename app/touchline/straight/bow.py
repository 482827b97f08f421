"""How far a lens bows straight edges, whether that is more than noise, and whether the edges bow by themselves.

Thousands of edge points make the smallest bow "significant", though invisible. A bow of B px leaves an edge 0.3 B rms
off its best line (2 / (3 √5) for a parabola): up to B = 3.35 × the edges' own rms it is within what they err anyway.
Nor does a bow count that the fit itself is not sure of: it must exceed 2 σ too. A line through the centre stays
straight under any lens, so the edge that bows most decides; the longest one is reported beside it. Short edges about
the centre are straight whatever the lens: "none" also takes what a line along the picture's own edge could bow.

Ropes sag, and boards bend: a bow that all edges share is their own, and no lens's. A lens bows an edge away from its
middle, or towards it, so edges on both sides of the middle bow in opposite ways:

    bow of edge i, px, along its normal n  =  Σ_j term_j · ∂bow_i/∂term_j  +  length_i · (n_i · share)

share (2,): by how much of its length the middle of every edge is displaced in the picture. Without it a fit puts the
lens's middle beyond the edges, or leaves those of one side out as not straight; with it they become straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Points
from touchline.models.distortion import Distortion
from touchline.straight.fit import SIGMA_PER_MEDIAN, PlumbLineFit, fit_plumb_lines
from touchline.straight.search import PlumbLineProblem

ALONG = np.linspace(0, 1, 33)[:, None]
# of its length: a line along the picture's edge could bow so much and pass for straight
MAX_UNSEEN_SHARE = 0.01
MIN_SAG_PX = 0.1  # a bow that no picture shows, however exact the points were made
SAG_PER_RMS = 1.5 * np.sqrt(5)  # bow over rms at which a parabola is as far off a line as the noise
MIN_STEP, MAX_STEP = 1e-7, 1e-4  # of a value, for its derivative
MAX_REWEIGHTS = 20
MIN_SIGMAS = 5.0
# Of the misfit without it, after a second round; the first, whose share a strong lens makes rough, must be no worse.
# honest lenses become at most 3 % straighter by it, whatever their centre and terms
MAX_MISFIT_RATIOS = (1.0, 0.85)
# the lens's middle lies farther beside the picture's: then being as straight is enough
MAX_CENTRE_SIGMAS = 6.0
MAX_MISFIT_RATIOS_OFF_CENTRE = (1.2, 1.05)
MAX_OPPOSITE_COSINE = -0.5  # of bows that point apart
MIN_NOISE_PX = 0.1
TERM_STEP = 1e-3  # for derivatives of bows by terms


@dataclass(frozen=True)
class LineSag:
    """How far the lens bows the line between a chain's ends, px, ± σ; index is the chain's."""

    index: int
    length_px: float
    px: float
    sigma_px: float


@dataclass(frozen=True)
class SagVerdict:
    """The edge that bows most, the longest one, and a line along the picture's own edge (index -1).

    noise_px: the sag that would be hidden by the edges' noise.
    """

    most: LineSag
    longest: LineSag
    border: LineSag
    noise_px: float

    @property
    def answer(self) -> Literal["significant", "none", "unknown"]:
        """Return whether the lens bows the edges visibly."""
        if self.most.px > max(self.noise_px, 2 * self.most.sigma_px):
            return "significant"
        within = (
            self.border.px + 2 * self.border.sigma_px < MAX_UNSEEN_SHARE * self.border.length_px
        )
        return "none" if self.most.px <= self.noise_px and within else "unknown"


def sag_verdict(fit: PlumbLineFit, chains: Sequence[Points]) -> SagVerdict:
    """Compare the sag of the chains that the fit used with their noise; chains as they were given to it."""
    used = [c for c in fit.chains if c.used]
    # Where edges were seen, another term would bow them alike; towards the border the two part.
    sags = [
        LineSag(chain.index, chain.length_px, px, sigma_px)
        for chain, px, sigma_px in zip(
            used, *_sags(fit, _ends_of_used(fit, chains), fit.statistical_covariance), strict=True
        )
    ]
    # Of the bows that the fit is sure of the largest: a short edge far out must not hide it.
    most = max(sags, key=lambda sag: (sag.px > 2 * sag.sigma_px, sag.px))
    return SagVerdict(
        most,
        max(sags, key=lambda sag: sag.length_px),
        _border_sag(fit),
        max(float(SAG_PER_RMS) * fit.after_px, MIN_SAG_PX),
    )


def _border_sag(fit: PlumbLineFit) -> LineSag:
    """Return the bow of that side of the picture which could bow most."""
    width, height = fit.lens.image_size
    sides = np.array(
        [[[0, y], [width - 1, y]] for y in (0.0, height - 1.0)]
        + [[[x, 0], [x, height - 1]] for x in (0.0, width - 1.0)]
    )
    px, sigma_px = _sags(fit, sides, fit.covariance)
    worst = int(np.argmax(np.nan_to_num(px, nan=np.inf) + 2 * np.array(sigma_px)))
    return LineSag(-1, float(np.ptp(sides[worst])), px[worst], sigma_px[worst])


def _ends_of_used(fit: PlumbLineFit, chains: Sequence[Points]) -> Array:
    return np.stack([_ends(np.asarray(chains[c.index], float)) for c in fit.chains if c.used])


def _ends(points: Points) -> Array:
    """Return the two points furthest apart along the line, (2, 2): clicks come in any order."""
    along = (points - points.mean(axis=0)) @ np.linalg.svd(
        points - points.mean(axis=0), full_matrices=False
    )[2][0]
    return points[[int(np.argmin(along)), int(np.argmax(along))]]


def _sags(fit: PlumbLineFit, ends: Array, covariance: Array) -> tuple[list[float], list[float]]:
    """Return px and σ of the lines between ends (c, 2, 2)."""
    steps = np.clip(1e-3 * fit.sigma, MIN_STEP, MAX_STEP)
    by_value = np.stack(
        [
            (
                sag_px(_with_value_moved(fit, i, step), ends)
                - sag_px(_with_value_moved(fit, i, -step), ends)
            )
            / (2 * step)
            for i, step in enumerate(steps)
        ],
        axis=1,
    )
    sigma = np.sqrt(np.einsum("ci,ij,cj->c", by_value, covariance, by_value))
    # Infinite where the lens ends just beyond: nothing is known of it there.
    return sag_px(fit.lens, ends).tolist(), np.where(np.isfinite(sigma), sigma, np.inf).tolist()


def sag_px(lens: Distortion, ends: Array) -> Array:
    """Return how far the picture of a straight line leaves the chord between its ends (…, 2, 2) px."""
    raw = picture_of_line(lens, ends)
    chord = ends[..., 1, :] - ends[..., 0, :]
    across = np.stack([-chord[..., 1], chord[..., 0]], axis=-1) / np.linalg.norm(
        chord, axis=-1, keepdims=True
    )
    return np.abs(np.einsum("...pi,...i->...p", raw - ends[..., :1, :], across)).max(axis=-1)


def picture_of_line(lens: Distortion, ends: Array, along: Array = ALONG) -> Array:
    """Return (…, n, 2) px: the straight line between ends (…, 2, 2) px as the lens shows it.

    along (n, 1): the places on the undistorted line, from 0 to 1.
    """
    straight = lens.undistorted_from_raw(ends)
    return lens.raw_from_undistorted(
        straight[..., :1, :] * (1 - along) + straight[..., 1:, :] * along
    )


def _with_value_moved(fit: PlumbLineFit, which: int, step: float) -> Distortion:
    terms, centre = list(fit.lens.terms), list(fit.lens.centre_px)
    name = fit.names[which]
    if name.startswith("centre"):
        centre[name == "centre_y"] += step
    else:
        terms[fit.lens.lens.TERMS.index(name)] += step
    return replace(fit.lens, terms=tuple(terms), centre_px=(centre[0], centre[1]))


def both_sides_seen(fit: PlumbLineFit, verdict: SagVerdict, chains: Sequence[Points]) -> bool:
    """Whether the lens bows two of the edges in opposite ways, both visibly: what no bow of their own does."""
    ends = _ends_of_used(fit, chains)
    # Where the lens moves the middle of the line between a chain's ends, off its chord.
    moves = picture_of_line(fit.lens, ends)[:, len(ALONG) // 2] - ends.mean(axis=1)
    lengths = np.linalg.norm(moves, axis=1)
    seen = lengths > verdict.noise_px / 2
    if not seen.any():
        return False
    directions = moves[seen] / lengths[seen, None]
    return bool((directions @ directions.T).min() < MAX_OPPOSITE_COSINE)


@dataclass(frozen=True, eq=False)
class CommonBow:
    """share (2,): displacement of the middle of every edge, x and y of the picture, of its length; its σ."""

    share: Array
    sigma: Array

    @property
    def axis(self) -> int:
        """Return the direction in which it stands out most: 0 across the picture, 1 down."""
        return int(np.argmax(np.abs(self.share) / self.sigma))


def common_bow(
    fit: PlumbLineFit,
    verdict: SagVerdict,
    chains: Sequence[Points],
    *,
    centre_sigma_px: float | None = None,
) -> CommonBow | None:
    """Return the bow that the edges share, if it explains them better than the lens alone; None otherwise.

    chains and centre_sigma_px as fit_plumb_lines took them.
    """
    size, pictures = fit.lens.image_size, [c.picture for c in fit.chains]
    given = [np.asarray(chain, float) for chain in chains]
    edges = {c.index: _Edge.of(given[c.index]) for c in fit.chains if np.isfinite(c.before_px)}
    lens = replace(fit.lens, centre_px=size.centre)
    names = [name for name in fit.names if not name.startswith("centre")]
    usual_px = PlumbLineProblem.of(fit.lens.name, None, centre_sigma_px, size).centre_sigma
    is_off_centre = (
        np.abs(np.subtract(fit.lens.centre_px, size.centre)).max() > MAX_CENTRE_SIGMAS * usual_px
    )
    min_share = verdict.noise_px / max(edge.length_px for edge in edges.values())
    share = np.zeros(2)
    # The share is found under the lens that the bows have bent, so again under the one that is left without them.
    for max_ratio in MAX_MISFIT_RATIOS_OFF_CENTRE if is_off_centre else MAX_MISFIT_RATIOS:
        step, sigma = _share(lens, names, [edge.without(share) for edge in edges.values()])
        share = share + step
        if not (np.abs(share) > np.maximum(MIN_SIGMAS * sigma, min_share)).any():
            return None
        straightened = [
            edges[i].without(share).points if i in edges else chain for i, chain in enumerate(given)
        ]
        try:
            better = fit_plumb_lines(
                straightened,
                size,
                fit.lens.name,
                pictures=pictures,
                centre_sigma_px=centre_sigma_px,
            )
        except FitFailed:
            return None
        if better.misfit > max_ratio * fit.misfit:
            return None
        lens = better.lens
    return CommonBow(share, sigma)


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
        """Return the edge with a parabola of that share of its length taken away."""
        return replace(
            self,
            points=self.points
            - np.outer(self.shape, self.normal) * self.length_px * float(self.normal @ share),
        )


def _share(lens: Distortion, names: list[str], edges: list[_Edge]) -> tuple[Array, Array]:
    """Return the share (2,) that the bows left by this lens ask for, and its σ; terms may move as well."""
    bows = _bows(lens, edges)
    by_terms = []
    for name in names:
        terms = np.array(lens.terms)
        terms[lens.lens.TERMS.index(name)] += TERM_STEP
        by_terms.append(
            (_bows(replace(lens, terms=tuple(terms.tolist())), edges) - bows) / TERM_STEP
        )
    by_share = np.transpose([edge.normal * edge.length_px for edge in edges])
    rows = np.stack([*by_terms, *by_share], axis=1)
    finite = np.isfinite(bows) & np.isfinite(rows).all(axis=1)
    rows, bows = rows[finite], bows[finite]
    weight, noise_px = _robust_line_weights(rows, bows)
    normal = rows.T @ (rows * weight[:, None])
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    values = inverse @ rows.T @ (weight * bows)
    return values[len(names) :], np.sqrt(np.diag(inverse))[len(names) :] * noise_px


def _robust_line_weights(rows: Array, bows: Array) -> tuple[Array, float]:
    """Return weights (e,) by which edges that are crooked in a way of their own hardly count, and the others' noise."""
    weight, noise_px = np.ones(len(bows)), MIN_NOISE_PX
    for _ in range(MAX_REWEIGHTS):
        root = np.sqrt(weight)
        off = bows - rows @ np.linalg.lstsq(rows * root[:, None], bows * root, rcond=1e-9)[0]
        noise_px = max(SIGMA_PER_MEDIAN * float(np.median(np.abs(off))), MIN_NOISE_PX)
        weight = 1 / (1 + (off / (2 * noise_px)) ** 2)
    return weight, noise_px


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
    """Return the normal (2,) of points' best line, and where each lies along it (n,), from -1 to 1."""
    about = points - points.mean(axis=0)
    direction = np.linalg.svd(about, full_matrices=False)[2][0]
    along = about @ direction
    low, high = along.min(), along.max()
    return np.array([-direction[1], direction[0]]), 2 * (along - low) / max(high - low, 1e-9) - 1
