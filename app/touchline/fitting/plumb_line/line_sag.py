"""How far a lens bows straight edges, in px, and whether that is more than noise.

Thousands of edge points make the smallest bow "significant", though invisible. A bow of B px leaves an edge 0.3 B rms
off its best line (2 / (3 √5) for a parabola): up to B = 3.35 × the edges' own rms it is within what they err anyway.
Nor does a bow count that the fit itself is not sure of: it must exceed 2 σ too. A line through the centre stays
straight under any lens, so the edge that bows most decides; the longest one is reported beside it. Short edges about
the centre are straight whatever the lens: "none" also takes what a line along the picture's own edge could bow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from touchline.core.geometry import Array, Points
from touchline.fitting.plumb_line.fit import PlumbLineFit
from touchline.models.distortion import Distortion

ALONG = np.linspace(0, 1, 33)[:, None]
MAX_UNSEEN_SHARE = 0.01  # of its length: a line along the picture's edge could bow so much and pass for straight
MIN_SAG_PX = 0.1  # a bow that no picture shows, however exact the points were made
SAG_PER_RMS = 1.5 * np.sqrt(5)  # bow over rms at which a parabola is as far off a line as the noise


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
        if self.most.px > max(self.noise_px, 2 * self.most.sigma_px):
            return "significant"
        within = self.border.px + 2 * self.border.sigma_px < MAX_UNSEEN_SHARE * self.border.length_px
        return "none" if self.most.px <= self.noise_px and within else "unknown"


def sag_verdict(fit: PlumbLineFit, chains: Sequence[Points]) -> SagVerdict:
    """Compare the sag of the chains that the fit used with their noise; chains as they were given to it."""
    width, height = fit.lens.image_size
    used = [c for c in fit.chains if c.used]
    ends = [_ends(np.asarray(chains[c.index], float)) for c in used]
    edges = np.array([[[0, y], [width - 1, y]] for y in (0.0, height - 1.0)]
                     + [[[x, 0], [x, height - 1]] for x in (0.0, width - 1.0)])
    sags = [LineSag(*v) for v in zip([c.index for c in used], [c.length_px for c in used],
                                 *_sags(fit, np.stack(ends), fit.statistical_covariance), strict=True)]
    # Where edges were seen, another term would bow them alike; towards the border the two part.
    # Of the bows that the fit is sure of the largest: a short edge far out must not hide it.
    most = max(sags, key=lambda b: (b.px > 2 * b.sigma_px, b.px))
    bows, sigma = _sags(fit, edges, fit.covariance)
    worst = int(np.argmax(np.nan_to_num(bows, nan=np.inf) + 2 * np.array(sigma)))
    border = LineSag(-1, float(np.ptp(edges[worst])), bows[worst], sigma[worst])
    return SagVerdict(most, max(sags, key=lambda b: b.length_px), border,
                      max(float(SAG_PER_RMS) * fit.after_px, MIN_SAG_PX))


def _ends(points: Points) -> Array:
    """Return the two points furthest apart along the line, (2, 2): clicks come in any order."""
    along = (points - points.mean(axis=0)) @ np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
    return points[[int(np.argmin(along)), int(np.argmax(along))]]


def _sags(fit: PlumbLineFit, ends: Array, covariance: Array) -> tuple[list[float], list[float]]:
    """Return px and σ of the lines between ends (c, 2, 2)."""
    by_value = np.stack([(sag_px(_with_value_moved(fit, i, step), ends)
                          - sag_px(_with_value_moved(fit, i, -step), ends)) / (2 * step)
                         for i, step in enumerate(np.clip(1e-3 * fit.sigma, 1e-7, 1e-4))], axis=1)
    sigma = np.sqrt(np.einsum("ci,ij,cj->c", by_value, covariance, by_value))
    # Infinite where the lens ends just beyond: nothing is known of it there.
    return sag_px(fit.lens, ends).tolist(), np.where(np.isfinite(sigma), sigma, np.inf).tolist()


def sag_px(lens: Distortion, ends: Array) -> Array:
    """Return how far the picture of a straight line leaves the chord between its ends (…, 2, 2) px."""
    raw = _picture_of_line(lens, ends)
    chord = ends[..., 1, :] - ends[..., 0, :]
    across = np.stack([-chord[..., 1], chord[..., 0]], axis=-1) / np.linalg.norm(chord, axis=-1, keepdims=True)
    return np.abs(np.einsum("...pi,...i->...p", raw - ends[..., :1, :], across)).max(axis=-1)


def sag_vectors(fit: PlumbLineFit, chains: Sequence[Points]) -> Array:
    """Return (used chains, 2) px: where the lens moves the middle of the line between a chain's ends, off its chord."""
    ends = np.stack([_ends(np.asarray(chains[c.index], float)) for c in fit.chains if c.used])
    return _picture_of_line(fit.lens, ends)[:, len(ALONG) // 2] - ends.mean(axis=1)


def _picture_of_line(lens: Distortion, ends: Array) -> Array:
    """Return (…, along, 2) px: the straight line between ends (…, 2, 2) px as the lens shows it."""
    straight = lens.undistorted_from_raw(ends)
    return lens.raw_from_undistorted(straight[..., :1, :] * (1 - ALONG) + straight[..., 1:, :] * ALONG)


def _with_value_moved(fit: PlumbLineFit, which: int, step: float) -> Distortion:
    terms, centre = list(fit.lens.terms), list(fit.lens.centre_px)
    name = fit.names[which]
    if name.startswith("centre"):
        centre[name == "centre_y"] += step
    else:
        terms[fit.lens.lens.TERMS.index(name)] += step
    return replace(fit.lens, terms=tuple(terms), centre_px=(centre[0], centre[1]))
