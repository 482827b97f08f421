"""A lens from many views of a board: start, robust search, outliers left out, terms chosen, covariance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from touchline.boards.board import BoardView
from touchline.boards.outliers import (
    FIRST_SIGMA_PX,
    OutlierRejection,
    RejectedView,
    refuse_bent_board,
    reject_outliers,
    unusable_views,
)
from touchline.boards.problem import WARP, BoardObservations, BoardParameters
from touchline.boards.solver import BoardSolution, BoardSolver, start_states, state_with_poses
from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import Array, ImageSize, Indices, Mask
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option, read_options
from touchline.core.statements import join, say
from touchline.fitting import FITTERS
from touchline.models import MODELS
from touchline.models.intrinsics import Intrinsics
from touchline.models.ray_camera import RayCamera

MIN_VIEWS = 3  # each view gives two numbers to the lens; three leave something to check it with
MIN_WARP_VIEWS = 4
MAX_SEARCH_STEPS = 15  # for each start; the best is then refined
MAX_SEARCH_VIEWS = 24  # enough to find the lens from, spread over all
MAX_SELECTION_VIEWS = 120  # enough to choose its terms from
# of the image's width: a lens that misses the corners by more explains none of them
MAX_SIGMA_SHARE = 0.02
MAX_OUTLIER_SHARE = 0.4  # of the corners
MAX_SELECTION_STEPS = 20  # a set of terms that takes longer is hardly supported
# Terms of a fraction can hide errors of the board and bend wildly beyond the corners: they must earn a fifth of σ.
MIN_RATIONAL_GAIN = 0.2
# What a board may not support is left out; a lens without a choice has one set.
TERM_SETS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "brown-conrady": (
        (),
        ("k1",),
        ("k1", "k2"),
        ("k1", "k2", "k3"),
        ("k1", "k2", "p1", "p2", "k3"),
    ),
    "fisheye": ((), ("k1",), ("k1", "k2"), ("k1", "k2", "k3", "k4")),
}

BOARD_OPTIONS: tuple[Option, ...] = (
    Option("warp", "bool", True, "Estimate the bow of the board: two numbers for all views."),
    Option("aspect", "bool", True, "Estimate the focal lengths in x and y separately."),
    Option(
        "centre", "bool", True, "Estimate the principal point; false fixes it at the image centre."
    ),
    Option(
        "robust",
        "bool",
        True,
        "Exclude corners and views that disagree with the rest, and list them.",
    ),
)


@dataclass(frozen=True, eq=False)
class BoardFit:
    """A lens and what it was fitted to.

    solution: the last fit; its views are the used ones. used (all views,); left_out: why the others are not. outliers
    (used views, m): corners left out, in the order of the view's own. tried: σ in px by set of terms.
    """

    lens: Intrinsics
    solver: BoardSolver
    solution: BoardSolution
    views: tuple[BoardView, ...]
    used: Mask
    left_out: tuple[RejectedView, ...]
    outliers: Mask
    tried: Mapping[str, float]

    @property
    def state(self) -> BoardParameters:
        return self.solution.minimum.state

    @property
    def observations(self) -> BoardObservations:
        return self.solution.problem.observations

    @property
    def terms(self) -> tuple[str, ...]:
        return self.solution.terms

    @property
    def sigma_px(self) -> float:
        return self.solution.sigma_px

    @property
    def residuals_px(self) -> Array:
        """Return (used views, m, 2) observed − projected of what was fitted; NaN elsewhere."""
        return self.solution.problem.residuals_px(self.state)

    @property
    def rms_px(self) -> float:
        """Return the rms distance of a corner: what OpenCV calls the reprojection error."""
        return float(np.sqrt(np.nanmean(np.sum(self.residuals_px**2, axis=-1))))

    def refit(self, keep: Mask | Indices) -> BoardSolution:
        """Fit some of the used views alone, starting from this fit."""
        return self.solver.solve(
            self.observations.only(keep), self.state.only(keep), self.terms, self.sigma_px
        )


def board_model(name: str) -> type[RayCamera]:
    """Return the model of that name; BadInput where it has no lens."""
    model = MODELS[name]
    if not (isinstance(model, type) and issubclass(model, RayCamera)):
        raise BadInput(
            f"A board cannot calibrate the lens of the model {name}.",
            "Choose brown-conrady, or fisheye for very wide lenses.",
            reason="bad-model",
        )
    return model


def board_options(model: type[RayCamera]) -> tuple[Option, ...]:
    """Return the options of a board calibration of that model."""
    return (
        *(option for option in FITTERS[model.NAME].OPTIONS if option.name == "terms"),
        *BOARD_OPTIONS,
    )


def fit_board(
    views: tuple[BoardView, ...],
    image_size: ImageSize,
    model: type[RayCamera],
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> BoardFit:
    """Fit the model's lens, the board's bow and every pose to the corners; FitFailed says what is missing."""
    settings = read_options(board_options(model), options)
    refuse_bent_board(views)
    left_out = list(unusable_views(views, image_size))
    usable = np.setdiff1d(np.arange(len(views)), [out.index for out in left_out])
    _refuse_too_few_views(len(usable), left_out)
    settings["warp"] = settings["warp"] and len(usable) >= MIN_WARP_VIEWS
    solver, term_sets = BoardSolver(image_size, settings), term_sets_for(model, settings)
    observations = BoardObservations.of(tuple(views[i] for i in usable))

    progress(0.05, "Fitting the lens")
    first_terms = term_sets[(len(term_sets) + 1) // 2] if len(term_sets) > 1 else term_sets[0]
    start = _search(solver, model, observations, first_terms)
    progress(0.3, "Excluding outliers")
    found = reject_outliers(
        solver, observations, start, first_terms, FIRST_SIGMA_PX, np.ones(len(usable), bool)
    )
    tried: dict[str, float] = {}
    if len(term_sets) > 1:
        found, tried = _select_terms(solver, found, observations, term_sets, progress)
    _refuse_too_few_views(int(found.used.sum()), left_out)
    progress(0.9, "Estimating the uncertainty")
    solution = solver.solve(
        observations.only(found.used).without(found.outliers[found.used]),
        found.state.only(found.used),
        found.solution.terms,
        found.solution.sigma_px,
    )
    _refuse_implausible(solution, found, observations)
    used = np.zeros(len(views), bool)
    used[usable[found.used]] = True
    names = observations.names
    left_out += [
        RejectedView(int(usable[i]), names[i], "disagrees", f"{names[i]} was excluded: {reason}.")
        for i, reason in enumerate(found.reasons)
        if reason
    ]
    estimated, covariance = lens_covariance(solution)
    lens = solution.minimum.state.lens_of(model.NAME, image_size, estimated, covariance)
    return BoardFit(
        lens,
        solver,
        solution,
        views,
        used,
        tuple(sorted(left_out, key=lambda out: out.index)),
        found.outliers[found.used],
        tried or {" ".join(solution.terms): solution.sigma_px},
    )


def _search(
    solver: BoardSolver,
    model: type[RayCamera],
    observations: BoardObservations,
    terms: tuple[str, ...],
) -> BoardParameters:
    """Return the best of several starts, found on some of the views, with the poses of all."""
    few = observations.only(_evenly_spaced(len(observations.pixels), MAX_SEARCH_VIEWS))
    tries = [
        solver.solve(few, start, terms, FIRST_SIGMA_PX, robust=True, max_steps=MAX_SEARCH_STEPS)
        for start in start_states(model, few, solver.image_size, distorts=bool(terms))
    ]
    best = min(tries, key=lambda t: t.minimum.cost)
    if not np.isfinite(best.minimum.cost):
        raise _no_camera_error()
    lens = best.minimum.state
    posed = state_with_poses(
        lens.lens,
        lens.terms,
        float(np.exp(lens.log_focal)),
        lens.aspect,
        lens.centre_px,
        observations,
    )
    return replace(posed, warp_mm=lens.warp_mm)


def _evenly_spaced(count: int, most: int) -> Indices:
    """Return indices of at most `most` of `count` views, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def term_sets_for(
    model: type[RayCamera], settings: Mapping[str, Any]
) -> tuple[tuple[str, ...], ...]:
    """Return the sets of terms to try, simplest first; one where they are given. A board may support all there are."""
    given = settings.get("terms", "auto")
    if given != "auto":
        return (tuple(given),)
    term_sets = TERM_SETS.get(model.NAME, (model.LENS.TERMS,))
    return term_sets if term_sets[-1] == model.LENS.TERMS else (*term_sets, model.LENS.TERMS)


def _select_terms(
    solver: BoardSolver,
    found: OutlierRejection,
    observations: BoardObservations,
    term_sets: tuple[tuple[str, ...], ...],
    progress: Progress,
) -> tuple[OutlierRejection, dict[str, float]]:
    """Fit every set of terms to the same corners; then reject anew what disagrees with the best."""
    some = np.flatnonzero(found.used)[_evenly_spaced(int(found.used.sum()), MAX_SELECTION_VIEWS)]
    same, sigma = observations.only(some).without(found.outliers[some]), found.solution.sigma_px
    state, solutions = found.state.only(some), []
    for number, terms in enumerate(term_sets):
        progress(
            0.4 + 0.4 * number / len(term_sets), f"Trying {' '.join(terms) or 'no distortion'}"
        )
        solutions.append(solver.solve(same, state, terms, sigma, max_steps=MAX_SELECTION_STEPS))
    chosen = _simplest_supported(solutions)
    best = solutions[chosen]
    start = best.minimum.state.with_poses_of(found.state, some)
    again = reject_outliers(
        solver, observations, start, term_sets[chosen], best.sigma_px, found.used
    )
    reasons = tuple(a or b for a, b in zip(found.reasons, again.reasons, strict=True))
    return replace(again, reasons=reasons), {" ".join(r.terms): r.sigma_px for r in solutions}


def _simplest_supported(solutions: Sequence[BoardSolution]) -> int:
    """Return the index of the simplest set that the richer ones, fitted to the same corners, do not beat."""
    best = 0
    for number, richer in enumerate(solutions[1:], 1):
        min_gain = MIN_RATIONAL_GAIN if {"k4", "k5", "k6"} <= set(richer.terms) else 0.0
        simple = solutions[best]
        if (
            _is_significantly_better(simple, richer)
            and richer.sigma_px < (1 - min_gain) * simple.sigma_px
        ):
            best = number
    return best


def _is_significantly_better(simple: BoardSolution, rich: BoardSolution) -> bool:
    """Return whether the extra terms explain more than noise would: a likelihood ratio test at about 1 %.

    The gain is measured against the noise of a corner, and against how much more than that the views scatter as wholes
    (J. Rao, A. Scott 1984): the errors of a detector and of a board are alike at all corners of a view.
    """
    extra = np.array([name not in simple.names for name in rich.names])
    q, freedom = int(extra.sum()), rich.freedom
    if (
        not q
        or freedom < 1
        or not (np.isfinite(rich.minimum.cost) and np.isfinite(rich.minimum.reduced).all())
    ):
        return False
    gain = (simple.minimum.cost - rich.minimum.cost) / q
    views = len(rich.problem.observations.pixels)
    limit = (4 + 3 / q) * (1 + 3 / max(views - q, 1))  # F at about 1 %
    noise = np.sum(rich.minimum.residuals**2) / freedom
    return bool(gain > limit * max(noise, _scatter_of_views(rich, extra)))


def _scatter_of_views(rich: BoardSolution, extra: Mask) -> float:
    """Return what one parameter gains by chance, given how each view alone would move the extra ones.

    tr(C⁻¹ Σ m mᵀ) / q: C the covariance of the q extra parameters, m (q,) what each view does to them.
    """
    reduced = rich.minimum.reduced
    covariance = _scaled_inverse(rich.minimum.information + np.diag(rich.prior**2), 1e-13)
    gradients = np.einsum("vij,vi->vj", reduced, rich.minimum.residuals.reshape(len(reduced), -1))
    moves = (gradients @ covariance)[:, extra]
    of_extra = covariance[np.ix_(extra, extra)]
    size = np.sqrt(np.diag(of_extra))  # both in σ of each, for the sake of the inverse
    scatter = (moves / size).T @ (moves / size) * len(reduced) / max(len(reduced) - 1, 1)
    inverse = np.linalg.pinv(of_extra / np.outer(size, size), rcond=1e-10, hermitian=True)
    return float(np.trace(inverse @ scatter) / extra.sum())


def lens_covariance(solution: BoardSolution) -> tuple[tuple[str, ...], Array]:
    """Return names and covariance of the lens's parameters; poses and the board's bow are marginalised."""
    of_lens = np.array([name not in WARP for name in solution.names])
    covariance = shared_covariance(solution)[np.ix_(of_lens, of_lens)]
    return tuple(np.array(solution.names)[of_lens].tolist()), covariance


def shared_covariance(solution: BoardSolution) -> Array:
    """Return the covariance of solution.names at the σ that the residuals have."""
    information = (
        solution.minimum.information
        * (solution.problem.sigma_px / max(solution.sigma_px, 1e-12)) ** 2
    )
    information = information + np.diag(solution.prior**2)
    if not np.isfinite(information).all():  # numpy's eigenvalues would not end
        return np.full_like(information, np.nan)
    return _scaled_inverse(information, 1e-15)


def _scaled_inverse(information: Array, rcond: float) -> Array:
    """Return the pseudo-inverse of a symmetric matrix, inverted with ones on its diagonal: its units differ widely."""
    scale = 1 / np.sqrt(np.diag(information))
    return np.linalg.pinv(
        information * np.outer(scale, scale), rcond=rcond, hermitian=True
    ) * np.outer(scale, scale)


def _refuse_implausible(
    solution: BoardSolution, found: OutlierRejection, observations: BoardObservations
) -> None:
    """Raise FitFailed for a minimum that is no camera's: corners that no camera saw have a minimum too."""
    outlier_share = found.outliers[found.used].sum() / max(
        observations.present[found.used].sum(), 1
    )
    finite = (
        np.isfinite(lens_covariance(solution)[1]).all()
        and np.isfinite(solution.minimum.state.shared).all()
    )
    if not (
        solution.sigma_px < MAX_SIGMA_SHARE * solution.problem.image_size.width
        and outlier_share < MAX_OUTLIER_SHARE
        and finite
    ):
        raise _no_camera_error()


def _no_camera_error() -> FitFailed:
    return FitFailed(
        say("refused.board-model", "No lens model reproduces the board in these views."),
        say(
            "refused.board-model.fix",
            "Check the columns and rows of the board, and that corners and places are in the "
            "same order.",
        ),
        reason="no-camera",
    )


def _refuse_too_few_views(count: int, left_out: list[RejectedView]) -> None:
    if count < MIN_VIEWS:
        raise FitFailed(
            join(
                say(
                    "refused.few-views",
                    "{n} views can be used; a lens calibration requires {least}.",
                    n=count,
                    least=MIN_VIEWS,
                ),
                left_out[0].text if left_out else "",
            ),
            say(
                "refused.few-views.fix",
                "Take about 20 images of the board, tilted in all directions and covering the "
                "whole frame.",
            ),
            reason="too-few-views",
        )
