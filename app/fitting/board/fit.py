"""A lens from many views of a board: start, robust search, what disagrees left out, terms chosen, covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.core.board import BoardView
from app.core.errors import BadInput, FitFailed
from app.core.geometry import Array, ImageSize
from app.core.options import Option, read_options
from app.core.progress import Progress, no_progress
from app.fitting import FITTERS
from app.fitting.board.initial import start_states, state_with_poses
from app.fitting.board.model_selection import chosen_rung, ladder_of
from app.fitting.board.outlier_rejection import FIRST_SIGMA_PX, Fitter, Gated, Solved, put_back
from app.fitting.board.parameters import WARP, BoardState, Sights
from app.fitting.board.views import LeftOut, refuse_what_is_no_board, unusable_views
from app.models import MODELS
from app.models.pinhole_lens import PinholeLens
from app.models.ray_camera import RayCamera

MIN_VIEWS = 3  # each view gives two numbers to the lens; three leave something to check it with
MIN_WARP_VIEWS = 4
SEARCH_STEPS = 15  # for each start; the best is then refined
SEARCH_VIEWS = 24  # enough to find the lens from, spread over all
LADDER_VIEWS = 120  # enough to choose its terms from
NONSENSE = 0.02  # of the picture's width: a lens that misses the corners by more explains none of them
NONSENSE_STRAYS = 0.4  # of the corners
LADDER_STEPS = 20  # a set of terms that takes longer is hardly supported

BOARD_OPTIONS: tuple[Option, ...] = (
    Option("warp", "bool", True, "Estimate how the board is bowed: two numbers for all views."),
    Option("aspect", "bool", True, "Estimate the focal lengths in x and y apart."),
    Option("centre", "bool", True, "Estimate the principal point; false holds it in the picture's middle."),
    Option("robust", "bool", True, "Leave out corners and views that disagree with the rest, and name them."),
)


@dataclass(frozen=True, eq=False)
class BoardFit:
    """A lens, and all that it rests on.

    used (all views,) bool; left_out: why the others are not. strays (used views, m) bool: corners left out, in the
    order of the view's own. tried: σ in px by set of terms. solved: the last fit; its views are the used ones.
    """

    lens: PinholeLens
    model: type[RayCamera]
    fitter: Fitter
    solved: Solved
    views: tuple[BoardView, ...]
    used: Array
    left_out: tuple[LeftOut, ...]
    strays: Array
    tried: Mapping[str, float]

    @property
    def state(self) -> BoardState:
        return self.solved.minimum.state

    @property
    def sights(self) -> Sights:
        return self.solved.problem.sights

    @property
    def terms(self) -> tuple[str, ...]:
        return self.solved.terms

    @property
    def sigma_px(self) -> float:
        return self.solved.sigma_px

    @property
    def residuals_px(self) -> Array:
        """(used views, m, 2) seen − projected of what was fitted; NaN elsewhere."""
        return self.solved.problem.away(self.state)

    @property
    def rms_px(self) -> float:
        """Root of the mean squared distance of a corner: what OpenCV calls the reprojection error."""
        return float(np.sqrt(np.nanmean(np.sum(self.residuals_px**2, axis=-1))))

    def again(self, keep: Array) -> Solved:
        """The same fit on some of the used views alone, beginning at this one."""
        return self.fitter.solve(self.sights.only(keep), self.state.only(keep), self.terms, self.sigma_px)


def board_model(name: str) -> type[RayCamera]:
    """The model of that name; BadInput where it has no lens."""
    model = MODELS[name]
    if not (isinstance(model, type) and issubclass(model, RayCamera)):
        raise BadInput(f"The model {name} has no lens that a board could tell.",
                       "Choose brown-conrady, or fisheye for very wide lenses.", reason="bad-model")
    return model


def board_options(model: type[RayCamera]) -> tuple[Option, ...]:
    """What a board calibration of that model can be told."""
    return (*(option for option in FITTERS[model.NAME].OPTIONS if option.name == "terms"), *BOARD_OPTIONS)


def fit_board(views: tuple[BoardView, ...], image_size: ImageSize, model: type[RayCamera],
              options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> BoardFit:
    """Fit the model's lens, the board's bow and every pose to the corners; FitFailed says what is missing."""
    settings = read_options(board_options(model), options)
    refuse_what_is_no_board(views)
    left_out = list(unusable_views(views, image_size))
    usable = np.setdiff1d(np.arange(len(views)), [out.index for out in left_out])
    _enough(len(usable), left_out)
    settings["warp"] = settings["warp"] and len(usable) >= MIN_WARP_VIEWS
    fitter, ladder = Fitter(image_size, settings), ladder_of(model, settings)
    sights = Sights.of(tuple(views[i] for i in usable))

    progress(0.05, "Looking for the lens")
    first = ladder[(len(ladder) + 1) // 2] if len(ladder) > 1 else ladder[0]
    start = _search(fitter, model, sights, first)
    progress(0.3, "Leaving out what disagrees")
    found = fitter.gate(sights, start, first, FIRST_SIGMA_PX, np.ones(len(usable), bool))
    tried = {}
    if len(ladder) > 1:
        found, tried = _choose(fitter, found, sights, ladder, progress)
    _enough(int(found.keep.sum()), left_out)
    progress(0.9, "Saying how sure it is")
    solved = _finish(fitter, found, sights)
    _refuse_nonsense(solved, found, sights)
    used = np.zeros(len(views), bool)
    used[usable[found.keep]] = True
    left_out += [LeftOut(int(usable[i]), sights.names[i], "disagrees", f"{sights.names[i]} was left out: {why}.")
                 for i, why in enumerate(found.why) if why]
    names, covariance = lens_covariance(solved)
    return BoardFit(solved.minimum.state.lens_of(model.NAME, image_size, names, covariance), model, fitter, solved,
                    views, used, tuple(sorted(left_out, key=lambda out: out.index)), found.strays[found.keep],
                    tried or {" ".join(solved.terms): solved.sigma_px})


def lens_covariance(solved: Solved) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the lens's unknowns; poses and the board's bow are marginalised."""
    of_lens = np.array([name not in WARP for name in solved.names])
    covariance = shared_covariance(solved)[np.ix_(of_lens, of_lens)]
    return tuple(np.array(solved.names)[of_lens].tolist()), covariance


def shared_covariance(solved: Solved) -> Array:
    """Of all that is estimated and shared, by solved.names, at the σ that the residuals have."""
    known = solved.prior
    information = solved.minimum.information * (solved.problem.sigma_px / max(solved.sigma_px, 1e-12)) ** 2
    information = information + np.diag(known**2)
    if not np.isfinite(information).all():  # numpy's eigenvalues would not end
        return np.full_like(information, np.nan)
    scale = 1 / np.sqrt(np.diag(information))
    return np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-15, hermitian=True) * np.outer(scale, scale)


def _search(fitter: Fitter, model: type[RayCamera], sights: Sights, terms: tuple[str, ...]) -> BoardState:
    """The best of several starts, on some of the views; then the poses of all."""
    few = sights.only(_spread(len(sights.pixels), SEARCH_VIEWS))
    tries = [fitter.solve(few, start, terms, FIRST_SIGMA_PX, robust=True, max_steps=SEARCH_STEPS)
             for start in start_states(model, few, fitter.image_size, bend=bool(terms))]
    best = min(tries, key=lambda t: t.minimum.cost)
    if not np.isfinite(best.minimum.cost):
        raise _no_camera()
    lens = best.minimum.state
    posed = state_with_poses(lens.lens, lens.terms, float(np.exp(lens.log_focal)), lens.aspect, lens.centre_px, sights)
    return replace(posed, warp_mm=lens.warp_mm)


def _choose(fitter: Fitter, found: Gated, sights: Sights, ladder: tuple[tuple[str, ...], ...], progress: Progress,
            ) -> tuple[Gated, dict[str, float]]:
    """Every rung on the same corners; then what disagrees with the chosen one, found anew."""
    some = np.flatnonzero(found.keep)[_spread(int(found.keep.sum()), LADDER_VIEWS)]
    same, sigma = sights.only(some).without(found.strays[some]), found.solved.sigma_px
    state, rungs = found.state.only(some), []
    for number, terms in enumerate(ladder):
        progress(0.4 + 0.4 * number / len(ladder), f"Trying {' '.join(terms) or 'no distortion'}")
        rungs.append(fitter.solve(same, state, terms, sigma, max_steps=LADDER_STEPS))
    chosen = chosen_rung(rungs)
    best = rungs[chosen]
    gated = fitter.gate(sights, put_back(found.state, best.minimum.state, some), ladder[chosen], best.sigma_px,
                        found.keep)
    why = tuple(a or b for a, b in zip(found.why, gated.why, strict=True))
    return Gated(gated.solved, gated.state, gated.keep, gated.strays, why), \
        {" ".join(r.terms): r.sigma_px for r in rungs}


def _spread(count: int, most: int) -> Array:
    """Indices of at most so many views, evenly over all."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))


def _finish(fitter: Fitter, found: Gated, sights: Sights) -> Solved:
    """The last fit, at the σ that the corners have, to the last digit."""
    return fitter.solve(sights.only(found.keep).without(found.strays[found.keep]), found.state.only(found.keep),
                        found.solved.terms, found.solved.sigma_px)


def _refuse_nonsense(solved: Solved, found: Gated, sights: Sights) -> None:
    """Corners that no camera could have seen give some minimum too; it is no lens."""
    left = found.strays[found.keep].sum() / max(sights.present[found.keep].sum(), 1)
    covariance = lens_covariance(solved)[1]
    if not (solved.sigma_px < NONSENSE * solved.problem.image_size.width and left < NONSENSE_STRAYS
            and np.isfinite(covariance).all() and np.isfinite(solved.minimum.state.shared).all()):
        raise _no_camera()


def _no_camera() -> FitFailed:
    return FitFailed("No camera was found that sees the board as these views show it.",
                     "Check the board's columns and rows, and that corners and places are in the same order.",
                     reason="no-camera")


def _enough(count: int, left_out: list[LeftOut]) -> None:
    if count < MIN_VIEWS:
        why = f" {left_out[0].text}" if left_out else ""
        raise FitFailed(f"{count} views can be used; a lens needs {MIN_VIEWS}.{why}",
                        "Take about twenty pictures of the board, tilted every way and all over the picture.",
                        reason="too-few-views")
