"""The fundamental matrix of two views from matches, some of which may be mistakes.

Matches determine its seven numbers only where the scene is more than a plane and the views have different centres.
Everything on the carpet is one plane: matches there agree with a whole family of geometries, each without a residual.
That is refused, as is a consensus that chance would give as well (a contrario, L. Moisan, B. Stival 2004).
"""

from dataclasses import dataclass
from math import lgamma, log

import numpy as np

from touchline.core import opencv
from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Indices, Mask, Points, as_matches, homogeneous, root_mean_square
from touchline.fitting.two_view.consensus import PARAMETERS, Consensus, consensus
from touchline.fitting.two_view.epipolar import FundamentalParameters, epipolar_px, sampson_px

MIN_MATCHES = 12  # seven are used up by the answer; the rest must bear it out
SAME_PX = 0.1
GOOD_SIGMAS = 4.0
MIN_SPREAD_PX = 2.0  # matches within such a strip are on one line
OFF_PLANE_SIGMAS = 10.0  # of Student's scale, two thirds of a σ, and of a distance in two directions from both views
MAX_SIGMA_PX = 4.0  # who matches no better than that has matched nothing
MIN_OFF_PLANE = 4  # two beside the plane make the geometry, two more bear it out
CHANCE = 1e-3  # expected number of such agreements among matches at random
WEAK = 1e-6  # of the scaled derivatives' largest singular value


@dataclass(frozen=True, eq=False)
class TwoViews:
    """fundamental (3, 3): (b, 1) F (a, 1)ᵀ = 0, rank 2, norm 1. good (n,); sigma_px: of the good ones.

    epipolar_px (n,): each match's distance from its epipolar lines, root mean square of both views.
    """

    fundamental: Array
    good: Mask
    epipolar_px: Array
    sigma_px: float

    @property
    def rms_px(self) -> float:
        """Return the rms of the good matches."""
        return root_mean_square(self.epipolar_px[self.good])

    @property
    def epipoles(self) -> tuple[Array, Array]:
        """Return both epipoles, homogeneous (3,): the one in view a, then the one in view b."""
        u, _, vt = np.linalg.svd(self.fundamental)
        return vt[2], u[:, 2]


def fundamental_matrix(a: Points, b: Points, seed: int = 0) -> TwoViews:
    """Estimate F from matches a, b (n, 2) px, some of which may be mistakes.

    Raises FitFailed: too-few-points, collinear-points, no-consensus, one-plane, not-determined; BadInput for what are
    no matches. The same seed gives the same answer.
    """
    a, b = as_matches(a, b)
    once = _distinct_matches(a, b)
    _refuse_too_few(a[once], b[once])
    found = consensus(a[once], b[once], seed)
    good = (found.good > 0.5) & (np.abs(sampson_px(found.fundamental, a[once], b[once]))
                                 <= GOOD_SIGMAS * found.sigma_px)
    _refuse_chance(found, good, a[once], b[once])
    _refuse_plane(found, good, a[once], b[once])
    _refuse_weak(found, a[once][good], b[once][good])
    all_good = np.zeros(len(a), bool)
    all_good[once[good]] = True
    return TwoViews(found.fundamental, all_good, epipolar_px(found.fundamental, a, b), found.sigma_px)


def _distinct_matches(a: Points, b: Points) -> Indices:
    """Indices of matches that share no point, in either view, with an earlier one.

    One point is seen at one place: of matches that say otherwise at most one is right. All of them would agree, for
    nothing, with a geometry that has its epipole there.
    """
    keep = np.arange(len(a))
    for points in (a, b):
        first = np.unique(np.round(points[keep] / SAME_PX), axis=0, return_index=True)[1]
        keep = keep[np.sort(first)]
    return keep


def _refuse_too_few(a: Points, b: Points) -> None:
    """Raise FitFailed for matches that are too few, or all on one line."""
    if len(a) < MIN_MATCHES:
        raise FitFailed(f"There are {len(a)} different matches; two views require {MIN_MATCHES}.",
                        f"Match at least {MIN_MATCHES - len(a)} more points.", reason="too-few-points")
    for points, which in ((a, "first"), (b, "second")):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
        if spread[-1] < MIN_SPREAD_PX:
            raise FitFailed(f"The matches are on one line in the {which} view.",
                            "Match points all over the shared area.", reason="collinear-points")


def _refuse_chance(found: Consensus, good: Mask, a: Points, b: Points) -> None:
    """Raise FitFailed where as many random matches would agree as well."""
    n, k = len(good), int(good.sum())
    if found.sigma_px > MAX_SIGMA_PX:
        raise FitFailed("The matches agree only within "
                        f"{found.sigma_px:.0f} px.",
                        "Check that both images show the same scene, and that points are given in pixels of their own "
                        "image.",
                        reason="no-consensus")
    if log_chance(n, k, PARAMETERS, _chance_share(found, a, b)) >= log(CHANCE):
        raise FitFailed(f"Only {k} of {n} matches agree with each other, which is no better than chance.",
                        "Check that both images show the same scene. Match more points, and more precisely.",
                        reason="no-consensus")


def log_chance(matches: int, agreeing: int, making: int, strip: float) -> float:
    """Return the logarithm of the expected number of agreements as good as this among random matches.

    making: how many matches made the geometry and so agree anyway; strip: the share of the picture in which
    another one agrees by chance.
    """
    if agreeing <= making:
        return 0.0
    return (log(matches - making) + _log_choose(matches, agreeing) + _log_choose(agreeing, making)
            + (agreeing - making) * log(strip))


def _chance_share(found: Consensus, a: Points, b: Points) -> float:
    extent = min(float(np.hypot(*np.ptp(points, axis=0))) for points in (a, b))
    return min(1.0, 2 * GOOD_SIGMAS * found.sigma_px / extent)


def _log_choose(n: int, k: int) -> float:
    return lgamma(n + 1) - lgamma(k + 1) - lgamma(n - k + 1)


def _refuse_plane(found: Consensus, good: Mask, a: Points, b: Points) -> None:
    """Raise FitFailed where a homography explains all but a few: a flat scene, or a camera that only turned.

    Geometries that agree with a plane have two numbers left, so any two mistakes fit one of them, and others by chance.
    """
    off = off_plane(a[good], b[good], found.sigma_px)
    aside = off + int((~good).sum())
    if off < MIN_OFF_PLANE or log_chance(aside, off, 2, _chance_share(found, a, b)) >= log(CHANCE):
        raise FitFailed("The matches are on one plane, or one camera only rotated: such matches fit many geometries. "
                        f"{off} are off the plane.",
                        "Match more points that are off that plane, such as robot tops or goal posts. For the carpet "
                        "alone use the agreement in millimetres.",
                        reason="one-plane")


def off_plane(a: Points, b: Points, sigma_px: float) -> int:
    """Return how many matches the best homography does not explain."""
    limit_px = OFF_PLANE_SIGMAS * sigma_px
    plane = opencv.find_homography(a, b, limit_px)
    if plane is None:
        return len(a)
    with np.errstate(all="ignore"):
        there = homogeneous(a) @ plane.T
        far = np.linalg.norm(there[:, :2] / there[:, 2:] - b, axis=1)
    return int((~(far < limit_px)).sum())


def _refuse_weak(found: Consensus, a: Points, b: Points) -> None:
    jacobian = FundamentalParameters.of(found.fundamental, a, b).residuals(a, b)[1]
    length = np.linalg.norm(jacobian, axis=0)
    spread = np.linalg.svd(jacobian / np.where(length > 0, length, 1.0), compute_uv=False)
    if not (np.isfinite(found.fundamental).all() and np.isfinite(spread).all() and spread[-1] > WEAK * spread[0]):
        raise FitFailed("The matches do not determine the relative position of the views.",
                        "Match points at more places and more heights.", reason="not-determined")
