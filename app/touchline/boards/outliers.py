"""What a fit leaves out: views that cannot be used, corners beyond the noise, and views that are wrong as a whole."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from touchline.boards.board import BoardView
from touchline.boards.problem import BoardObservations, BoardParameters
from touchline.boards.solver import BoardSolution, BoardSolver
from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, Mask, inside_picture
from touchline.core.json_values import JsonObject
from touchline.core.statements import format_number, sentence

# a pose takes six of twelve numbers; with four corners, one wrong corner would go unseen
MIN_CORNERS = 6
MIN_WIDTH_SHARE = 0.02  # corners narrower than this share of their length are on one line
# two images never agree so well; an image given twice would seem to make the lens surer
SAME_IMAGE_PX = 1e-3
MAX_BOW = 0.05  # of the board's extent; a bow beyond it is no board
FIRST_SIGMA_PX = 0.5  # of a corner, before it is estimated
MIN_NOISE_PX = 0.005  # rounding errors of exact corners must not become outliers
OUTLIER_SIGMAS = 4.5  # exceeded by a Gaussian corner once in 25,000
MAX_VIEW_OUTLIERS = 0.3  # of a view's corners: more, and the view is wrong, not its corners
MAX_VIEW_RATIO = 4.0  # the usual view's residual
MAX_LEFT_OUT = 0.4  # of all views; more than that are no exceptions
MAX_ROUNDS = 8  # of leaving out and fitting again; two or three are usual
RAYLEIGH_MEDIAN = 1.17741  # √(2 ln 2): the median length of a residual, in σ


@dataclass(frozen=True)
class RejectedView:
    """A view that is not used. index: among all views, from 0."""

    index: int
    name: str
    reason: str  # kebab-case, for scripts
    text: str  # one sentence

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", sentence(self.text))

    def to_json(self) -> JsonObject:
        return dict(vars(self))


def unusable_views(views: tuple[BoardView, ...], image_size: ImageSize) -> Iterator[RejectedView]:
    """Yield the views that are rejected before anything is computed, each with its reason."""
    first: dict[bytes, str] = {}
    for index, view in enumerate(views):
        name = view.name or f"view {index + 1}"
        n = len(view.pixels)
        if n < MIN_CORNERS:
            yield RejectedView(
                index,
                name,
                "too-few-corners",
                f"{name} has {n} corners; at least {MIN_CORNERS} are required.",
            )
        elif _are_collinear(view.pixels) or _are_collinear(view.places_mm[:, :2]):
            yield RejectedView(
                index,
                name,
                "corners-on-a-line",
                f"The corners of {name} are on one line and do not determine a pose.",
            )
        elif not inside_picture(view.pixels, image_size, -1).all():
            yield RejectedView(
                index,
                name,
                "outside-picture",
                f"{name} has corners outside the image of {image_size}.",
            )
        elif (same := np.rint(view.pixels / SAME_IMAGE_PX).tobytes()) in first:
            yield RejectedView(
                index,
                name,
                "seen-already",
                f"{name} repeats {first[same]} and adds no information.",
            )
        else:
            first[same] = name


def _are_collinear(points: Array) -> bool:
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return not extents[1] > MIN_WIDTH_SHARE * extents[0]


def refuse_bent_board(views: tuple[BoardView, ...]) -> None:
    """Raise FitFailed where the corners' places are not those of one flat board."""
    places = np.concatenate([view.places_mm for view in views]) if views else np.zeros((0, 3))
    if len(places) and np.ptp(places[:, 2]) > MAX_BOW * max(
        np.ptp(places[:, 0]), np.ptp(places[:, 1])
    ):
        raise FitFailed(
            "The object points are not in one plane.",
            "Use a flat board, with z = 0 on its face.",
            reason="board-not-flat",
        )


@dataclass(frozen=True, eq=False)
class OutlierRejection:
    """used (v,): views; outliers (v, m): corners left out; reasons (v,): why a view is left out, "" where it is not."""

    solution: BoardSolution
    state: BoardParameters  # of all views, used or not
    used: Mask
    outliers: Mask
    reasons: tuple[str, ...]


def reject_outliers(
    solver: BoardSolver,
    observations: BoardObservations,
    start: BoardParameters,
    terms: tuple[str, ...],
    sigma_px: float,
    used: Mask,
) -> OutlierRejection:
    """Fit, leave out what disagrees, fit again, until nothing changes. used (v,): views to begin with."""
    robust = solver.settings["robust"]
    used, outliers = used.copy(), np.zeros(observations.present.shape, bool)
    reasons = [""] * len(used)
    state = start
    for number in range(MAX_ROUNDS):
        first = robust and number == 0
        solution = solver.solve(
            observations.only(used).without(outliers[used]),
            state.only(used),
            terms,
            sigma_px,
            robust=first,
        )
        state = solution.minimum.state.with_poses_of(state, used)
        if not robust:
            break
        distances = _distances_px(solution, observations.only(used))
        present = observations.present[used]
        # at first from the median length, which outliers hardly move
        typical = (
            float(np.median(distances[present])) / RAYLEIGH_MEDIAN if first else solution.sigma_px
        )
        sigma_px = max(typical, MIN_NOISE_PX)
        beyond = np.zeros_like(outliers)
        beyond[used] = distances > OUTLIER_SIGMAS * sigma_px
        wrong = _wrong_views(distances, beyond[used], present)
        left_out_before = len(used) - used.sum()
        if wrong.any() and left_out_before + wrong.sum() <= MAX_LEFT_OUT * len(used):
            wrong_views = np.flatnonzero(used)[wrong]
            for index, median in zip(
                wrong_views, np.nanmedian(distances, axis=1)[wrong], strict=True
            ):
                reasons[index] = (
                    f"its corners are {format_number(median)} px from the position predicted by the "
                    "other views"
                )
            used[wrong_views] = False
        elif np.array_equal(beyond, outliers) and not first:
            break
        outliers = beyond & used[:, None]
    return OutlierRejection(solution, state, used, outliers, tuple(reasons))


def _distances_px(solution: BoardSolution, observations: BoardObservations) -> Array:
    """Return how far corners are from their projections (v, m): NaN of padding, infinite where none is projected."""
    residuals = replace(solution.problem, observations=observations).residuals_px(
        solution.minimum.state
    )
    distances = np.linalg.norm(residuals, axis=-1)
    return np.where(observations.present & np.isnan(distances), np.inf, distances)


def _wrong_views(distances: Array, beyond: Mask, present: Mask) -> Mask:
    """Return views (v,) whose residuals are several times the usual, or that have many outliers."""
    medians = np.nanmedian(distances, axis=1)
    share = beyond.sum(axis=1) / np.maximum(present.sum(axis=1), 1)
    return (medians > np.maximum(MAX_VIEW_RATIO * np.median(medians), MIN_NOISE_PX)) | (
        share > MAX_VIEW_OUTLIERS
    )
