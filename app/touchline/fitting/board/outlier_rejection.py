"""Fitting anew until what disagrees is left out: corners beyond the noise, and views that are wrong whole."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from touchline.core.geometry import Array, ImageSize, Mask
from touchline.core.text_format import format_number
from touchline.fitting.board.least_squares import BlockMinimum
from touchline.fitting.board.parameters import BoardObservations, BoardParameters
from touchline.fitting.board.problem import BoardProblem, free_mask

FIRST_SIGMA_PX = 0.5  # of a corner, before it is estimated
MIN_SIGMA_PX = 0.005  # rounding errors of exact corners must not become outliers
MIN_RESIDUAL_SIGMA_PX = 1e-6  # no corner counts more than that, exact as it may be
OUTLIER_SIGMAS = 4.5  # exceeded by a Gaussian corner once in 25,000
MAX_VIEW_OUTLIERS = 0.3  # of a view's corners: more, and the view is wrong, not its corners
MAX_VIEW_RATIO = 4.0  # the usual view's residual
MAX_LEFT_OUT = 0.4  # of all views; more than that are no exceptions
ROUNDS = 8  # of leaving out and fitting again; two or three are usual
RAYLEIGH_MEDIAN = 1.17741  # √(2 ln 2): the median length of a residual, in σ


@dataclass(frozen=True, eq=False)
class BoardSolution:
    """A problem and its minimum."""

    problem: BoardProblem
    minimum: BlockMinimum[BoardParameters]
    terms: tuple[str, ...]

    @property
    def sigma_px(self) -> float:
        """Return σ of one coordinate of a corner."""
        squares = float(np.sum(self.minimum.residuals**2)) * self.problem.sigma_px**2
        return float(np.sqrt(squares / max(self.freedom, 1)))

    @property
    def freedom(self) -> int:
        return 2 * int(self.problem.observations.present.sum()) - int(self.problem.free.sum()) \
            - 6 * len(self.problem.observations.pixels)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the shared unknowns that were estimated."""
        return tuple(np.array(self.minimum.state.names)[self.problem.free])

    @property
    def prior(self) -> Array:
        """Return 1/σ of the prior of each of names."""
        return self.problem.prior_of(self.minimum.state)


@dataclass(frozen=True, eq=False)
class OutlierRejection:
    """keep (v,): views that are used; outliers (v, m): corners left out; why (v,): "" or why a view is left out."""

    solution: BoardSolution
    state: BoardParameters  # of all views, used or not
    keep: Mask
    outliers: Mask
    why: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class BoardSolver:
    """Fits boards under the settings of one calibration."""

    image_size: ImageSize
    settings: Mapping[str, Any]

    def solve(self, observations: BoardObservations, start: BoardParameters, terms: tuple[str, ...], sigma_px: float, *,
              robust: bool = False, max_steps: int = 50) -> BoardSolution:
        keep = np.array([name in terms for name in start.lens.TERMS], bool)
        start = replace(start, terms=np.where(keep, start.terms, 0.0))
        free = free_mask(start, terms, **{name: self.settings[name] for name in ("aspect", "centre", "warp")})
        problem = BoardProblem(observations, free, self.image_size, max(sigma_px, MIN_RESIDUAL_SIGMA_PX))
        return BoardSolution(problem, problem.solve(start, robust=robust, max_steps=max_steps), terms)

    def poses(self, observations: BoardObservations, start: BoardParameters,
              sigma_px: float) -> BlockMinimum[BoardParameters]:
        """Fit the poses alone; the lens and the bow are fixed."""
        nothing = np.zeros(len(start.names), bool)
        return BoardProblem(observations, nothing, self.image_size, max(sigma_px, MIN_RESIDUAL_SIGMA_PX)).solve(start)

    def reject_outliers(self, observations: BoardObservations, start: BoardParameters, terms: tuple[str, ...],
                        sigma_px: float, keep: Mask) -> OutlierRejection:
        """Fit, leave out what disagrees, fit again, until nothing changes. keep (v,): views to begin with."""
        robust = self.settings["robust"]
        keep, outliers = keep.copy(), np.zeros(observations.present.shape, bool)
        why = [""] * len(keep)
        state = start
        for number in range(ROUNDS):
            first = robust and number == 0
            solution = self.solve(observations.only(keep).without(outliers[keep]), state.only(keep), terms, sigma_px,
                                robust=first)
            state = solution.minimum.state.with_poses_of(state, keep)
            if not robust:
                break
            used = observations.only(keep)
            residuals = replace(solution.problem, observations=used).residuals_px(solution.minimum.state)
            away = np.linalg.norm(residuals, axis=-1)
            away = np.where(used.present & np.isnan(away), np.inf, away)  # infinite where it cannot be projected
            # at first from the median length, which outliers hardly move
            typical = float(np.median(away[used.present])) / RAYLEIGH_MEDIAN if first else solution.sigma_px
            sigma_px = max(typical, MIN_SIGMA_PX)
            beyond = np.zeros_like(outliers)
            beyond[keep] = away > OUTLIER_SIGMAS * sigma_px
            wrong = _wrong_views(away, beyond[keep], observations.present[keep])
            if wrong.any() and (len(keep) - keep.sum() + wrong.sum()) <= MAX_LEFT_OUT * len(keep):
                for index, usual in zip(np.flatnonzero(keep)[wrong], np.nanmedian(away, axis=1)[wrong], strict=True):
                    why[index] = (f"its corners are {format_number(usual)} px from the position predicted by the other "
                                  "views")
                keep[np.flatnonzero(keep)[wrong]] = False
            elif np.array_equal(beyond, outliers) and not first:
                break
            outliers = beyond & keep[:, None]
        return OutlierRejection(solution, state, keep, outliers, tuple(why))


def _wrong_views(away: Array, beyond: Mask, present: Mask) -> Mask:
    """Return views whose residuals are several times the usual, or that have many outliers."""
    medians = np.nanmedian(away, axis=1)
    share = beyond.sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    return (medians > np.maximum(MAX_VIEW_RATIO * np.median(medians), MIN_SIGMA_PX)) | (share > MAX_VIEW_OUTLIERS)
