"""Fitting anew until what disagrees is left out: corners beyond the noise, and views that are wrong whole."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.core.geometry import Array, ImageSize
from app.core.text_format import format_number
from app.fitting.board.least_squares import Blocks
from app.fitting.board.parameters import BoardState, Sights
from app.fitting.board.problem import BoardProblem, free_mask

FIRST_SIGMA_PX = 0.5  # of a corner, before the corners themselves tell
LEAST_SIGMA_PX = 0.005  # exact corners must not make strays of rounding errors
LEAST_WEIGHT_PX = 1e-6  # no corner counts more than that, exact as it may be
STRAY_SIGMAS = 4.5  # a Gaussian corner lies beyond once in 25,000
VIEW_STRAYS = 0.3  # of a view's corners: more, and the view is wrong, not its corners
VIEW_TIMES = 4.0  # the usual view's residual
MAX_LEFT_OUT = 0.4  # of all views; more than that are no exceptions
ROUNDS = 8  # of leaving out and fitting again; two or three are usual
RAYLEIGH_MEDIAN = 1.17741  # √(2 ln 2): the median length of a residual, in σ


@dataclass(frozen=True, eq=False)
class Solved:
    """A problem and its minimum."""

    problem: BoardProblem
    minimum: Blocks[BoardState]
    terms: tuple[str, ...]

    @property
    def sigma_px(self) -> float:
        """Of one coordinate of a corner."""
        squares = float(np.sum(self.minimum.residuals**2)) * self.problem.sigma_px**2
        return float(np.sqrt(squares / max(self.freedom, 1)))

    @property
    def freedom(self) -> int:
        return 2 * int(self.problem.sights.present.sum()) - int(self.problem.free.sum()) \
            - 6 * len(self.problem.sights.pixels)

    @property
    def names(self) -> tuple[str, ...]:
        """Of what was estimated and is shared."""
        return tuple(np.array(self.minimum.state.names)[self.problem.free])

    @property
    def prior(self) -> Array:
        """1/σ of what was known of each of names beforehand."""
        return self.problem.prior_of(self.minimum.state)


@dataclass(frozen=True, eq=False)
class Gated:
    """keep (v,): views that are left; strays (v, m): corners left out; why (v,): "" or the reason for leaving out."""

    solved: Solved
    state: BoardState  # of all views, kept or not
    keep: Array
    strays: Array
    why: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Fitter:
    """What stays the same during one calibration."""

    image_size: ImageSize
    settings: Mapping[str, Any]

    def solve(self, sights: Sights, start: BoardState, terms: tuple[str, ...], sigma_px: float, *,
              robust: bool = False, max_steps: int = 50) -> Solved:
        keep = np.array([name in terms for name in start.lens.TERMS], bool)
        start = replace(start, terms=np.where(keep, start.terms, 0.0))
        free = free_mask(start, terms, **{name: self.settings[name] for name in ("aspect", "centre", "warp")})
        problem = BoardProblem(sights, free, self.image_size, max(sigma_px, LEAST_WEIGHT_PX))
        return Solved(problem, problem.solve(start, robust=robust, max_steps=max_steps), terms)

    def poses(self, sights: Sights, start: BoardState, sigma_px: float) -> Blocks[BoardState]:
        """The same with the lens and the bow held fast."""
        nothing = np.zeros(len(start.names), bool)
        return BoardProblem(sights, nothing, self.image_size, max(sigma_px, LEAST_WEIGHT_PX)).solve(start)

    def gate(self, sights: Sights, start: BoardState, terms: tuple[str, ...], sigma_px: float, keep: Array) -> Gated:
        """Fit, leave out what disagrees, fit again, until nothing changes. keep (v,): views to begin with."""
        robust = self.settings["robust"]
        keep, strays = keep.copy(), np.zeros(sights.present.shape, bool)
        why = [""] * len(keep)
        state = start
        for number in range(ROUNDS):
            first = robust and number == 0
            solved = self.solve(sights.only(keep).without(strays[keep]), state.only(keep), terms, sigma_px,
                                robust=first)
            state = put_back(state, solved.minimum.state, keep)
            if not robust:
                break
            away = _lengths(replace(solved.problem, sights=sights.only(keep)), solved.minimum.state)
            sigma_px = max(_usual(away, sights.present[keep]) if first else solved.sigma_px, LEAST_SIGMA_PX)
            beyond = np.zeros_like(strays)
            beyond[keep] = away > STRAY_SIGMAS * sigma_px
            wrong = _wrong_views(away, beyond[keep], sights.present[keep])
            if wrong.any() and (len(keep) - keep.sum() + wrong.sum()) <= MAX_LEFT_OUT * len(keep):
                for index, usual in zip(np.flatnonzero(keep)[wrong], _medians(away)[wrong], strict=True):
                    why[index] = f"its corners lie {format_number(usual)} px from where the other views' lens puts them"
                keep[np.flatnonzero(keep)[wrong]] = False
            elif np.array_equal(beyond, strays) and not first:
                break
            strays = beyond & keep[:, None]
        return Gated(solved, state, keep, strays, tuple(why))


def put_back(full: BoardState, part: BoardState, keep: Array) -> BoardState:
    """The state of all views, with what was found for some (mask or indices)."""
    rotations, shifts = full.rotations.copy(), full.shifts_mm.copy()
    rotations[keep], shifts[keep] = part.rotations, part.shifts_mm
    return replace(part, rotations=rotations, shifts_mm=shifts)


def _lengths(problem: BoardProblem, state: BoardState) -> Array:
    """(v, m) px; infinite where a corner cannot be projected, NaN where there is none."""
    away = np.linalg.norm(problem.away(state), axis=-1)
    return np.where(problem.sights.present & np.isnan(away), np.inf, away)


def _medians(away: Array) -> Array:
    return np.nanmedian(away, axis=1)


def _usual(away: Array, present: Array) -> float:
    """σ of a coordinate from the median length, which strays hardly move."""
    return float(np.median(away[present])) / RAYLEIGH_MEDIAN


def _wrong_views(away: Array, beyond: Array, present: Array) -> Array:
    """Views whose residuals are several times the usual, or that have many strays."""
    medians = _medians(away)
    share = beyond.sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    return (medians > np.maximum(VIEW_TIMES * np.median(medians), LEAST_SIGMA_PX)) | (share > VIEW_STRAYS)
