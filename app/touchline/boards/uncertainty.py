"""How far to trust a lens from a board: its covariance over the image, how it was held, and which view would help most.

Expected error. A ray held fast is seen elsewhere when the lens's parameters move. What a rotation of the camera could
undo is taken out first, over the whole image, for a pose will undo it: the focal length alone never has an error in px.

Cross-validation. Each fifth of the views is left out in turn, and both halves give a lens of their own. Held-out
residuals reveal a wrong model and too few views. They hardly reveal badly spread views, for a pose takes up much of a
lens's error; two lenses from two halves do, where they disagree over the image.

Focal drift. Zoom or focus that creeps, slips or was touched while the views were taken:

    c = t · ∂r/∂log f      t: the order of the views, as a step at the middle and as a ramp, each of height 1

What the fit itself could explain of c, poses included, is taken out; the rest of c against the residuals gives the
change. So halves that saw other places of the image, or other distances, do not count as a change.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from touchline.boards.fit import BoardFit, shared_covariance
from touchline.boards.poses import (
    EDGES,
    NEXT_SHARE,
    NEXT_TILT_DEG,
    board_rotation,
    edge_towards,
    ninth_centre,
    ninth_name,
    view_instruction,
)
from touchline.boards.problem import WARP, BoardObservations, BoardProblem
from touchline.core.geometry import Array, Mask, Points
from touchline.core.json_values import JsonObject
from touchline.core.statements import stated
from touchline.models.intrinsics import Intrinsics, lens_difference, picture_grid

# columns, rows over the image: wherever its worst place is asked for, it is the same one
ERROR_GRID = (24, 18)
FOLDS = 5
MIN_VIEWS = 6  # of a cross-validation and a drift: halves of three are the least that make a lens
MIN_DRIFT_SIGMAS = 5.0  # honest series in any order reach 3.1
MIN_DRIFT = 0.002  # 1 px at an image's border; of 810 honest orders none shows more than 0.0016

# less is hardly a tilt: a board shows the focal length by its foreshortening, 1 - cos
MIN_TILT_DEG = 12.0
MIN_NEXT_CORNERS = 12  # fewer inside the image are no view


def expected_over_picture(lens: Intrinsics) -> Array:
    """Return the expected error at ERROR_GRID over the image, (rows, columns) px."""
    sensitivity = lens_sensitivity(lens, lens.estimated, error_pixels(lens))
    return expected_px(sensitivity, np.array(lens.covariance)).reshape(ERROR_GRID[::-1])


def error_pixels(lens: Intrinsics) -> Points:
    """Return the pixels (n, 2) of ERROR_GRID."""
    return picture_grid(lens.image_size, *ERROR_GRID).reshape(-1, 2)


def lens_sensitivity(lens: Intrinsics, names: tuple[str, ...], pixels: Points) -> Array:
    """Return px per unit of each named parameter at pixels (n, 2), rotations taken out: (n, 2, len(names)).

    NaN where the lens has no ray.
    """
    rays = lens.rays(pixels)
    plane, by_ray, by_terms = lens.lens.distort_jacobian(np.array(lens.terms), rays)
    focal = lens.focal_px * np.array([1.0, lens.aspect])
    by_parameter = np.zeros((len(pixels), 2, len(names)))
    for column, name in enumerate(names):
        if name == "log_focal":
            by_parameter[..., column] = plane * focal
        elif name == "aspect":
            by_parameter[:, 1, column] = plane[:, 1] * lens.focal_px
        elif name in ("centre_x", "centre_y"):
            by_parameter[:, int(name == "centre_y"), column] = 1.0
        else:
            by_parameter[..., column] = by_terms[..., lens.lens.TERMS.index(name)] * focal
    by_rotation = np.cross(rays[:, None, :], by_ray * focal[:, None])
    finite = np.isfinite(by_parameter).all(axis=(1, 2)) & np.isfinite(by_rotation).all(axis=(1, 2))
    if finite.sum() >= 3:
        undo = np.linalg.lstsq(
            by_rotation[finite].reshape(-1, 3),
            by_parameter[finite].reshape(-1, len(names)),
            rcond=None,
        )[0]
        by_parameter = by_parameter - by_rotation @ undo
    by_parameter[~finite] = np.nan
    return by_parameter


def expected_px(sensitivity: Array, covariance: Array) -> Array:
    """Return the root of the expected squared error (n,) px, by lens_sensitivity and the covariance of its names."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(
            np.maximum(np.einsum("nij,jk,nik->n", sensitivity, covariance, sensitivity), 0)
        )


@dataclass(frozen=True)
class CrossValidation:
    """What left-out views show; NaN where there are too few.

    held_out_px: σ of one coordinate of a corner in a left-out view. halves_px: median over the image of how far the
    lenses from half the views each differ, halved: what the whole set's lens may be off. The ratios are to the
    residuals' σ.
    """

    held_out_px: float
    held_out_ratio: float
    halves_px: float
    halves_ratio: float

    def to_json(self) -> JsonObject:
        return dict(vars(self))


def cross_validate(fit: BoardFit) -> CrossValidation:
    """Fit again without some views; terms and outliers stay."""
    count = len(fit.observations.pixels)
    if count < MIN_VIEWS:
        return CrossValidation(*[float("nan")] * 4)
    order = np.arange(count)
    squares, freedom = np.sum(
        [_held_out_squares(fit, order % FOLDS == fold) for fold in range(FOLDS)], axis=0
    )
    held_out_px = float(np.sqrt(squares / max(freedom, 1)))
    first, second = (
        fit.refit(order % 2 == half).minimum.state.lens_of(fit.lens.model, fit.lens.image_size)
        for half in (0, 1)
    )
    halves_px = float(np.nanmedian(np.linalg.norm(lens_difference(first, second), axis=-1))) / 2
    sigma = max(fit.sigma_px, 1e-9)
    return CrossValidation(held_out_px, held_out_px / sigma, halves_px, halves_px / sigma)


def _held_out_squares(fit: BoardFit, held_out: Mask) -> tuple[float, float]:
    """Return the sum of squares, px², and the degrees of freedom of views that the lens is not fitted to.

    Only their poses are.
    """
    without = fit.refit(~held_out).minimum.state
    start = fit.state.only(held_out).with_shared(without.shared)
    posed = fit.solver.fit_poses(fit.observations.only(held_out), start, fit.sigma_px)
    squares = float(np.sum(posed.residuals**2)) * fit.sigma_px**2
    return squares, 2 * float(fit.observations.present[held_out].sum()) - 6 * float(held_out.sum())


@dataclass(frozen=True)
class FocalDrift:
    """How much longer the focal length is in the second half of the views, as a share of it; NaN with few views."""

    change: float
    sigma: float

    @classmethod
    def of(cls, fit: BoardFit) -> Self:
        """Return the step or the ramp over the views' order, whichever stands out more."""
        count = len(fit.observations.pixels)
        if count < MIN_VIEWS:
            return cls(float("nan"), float("nan"))
        order = (np.arange(count) - (count - 1) / 2) / count  # -0.5 to 0.5
        drifts = (cls(*_focal_change(fit, shape)) for shape in (np.sign(order) / 2, 2 * order))
        return max(drifts, key=lambda drift: abs(drift.change) / drift.sigma)

    @property
    def significant(self) -> bool:
        return abs(self.change) > max(MIN_DRIFT_SIGMAS * self.sigma, MIN_DRIFT)

    def to_json(self) -> JsonObject:
        return {"pct": 100 * self.change, "sigma_pct": 100 * self.sigma}


def _focal_change(fit: BoardFit, shape: Array) -> tuple[float, float]:
    """Return the change of log f and its σ, by least squares for one more parameter at the fit's minimum.

    shape (v,): how far the change has come in each view. σ: of noise alone, and of the scatter from view to view, which
    also holds what corners of one view share.
    """
    minimum, views = fit.solution.minimum, len(shape)
    reduced = minimum.reduced
    by_change = reduced[..., fit.solution.names.index("log_focal")] * shape[:, None]
    # What the fit's own parameters explain of it is taken out; the rest is what only the change can explain.
    known = np.concatenate([reduced.reshape(by_change.size, -1), np.diag(fit.solution.prior)])
    known /= np.linalg.norm(known, axis=0)
    padded = np.append(by_change.ravel(), np.zeros(known.shape[1]))
    explained = known @ np.linalg.lstsq(known, padded, rcond=None)[0]
    own = by_change - explained[: by_change.size].reshape(by_change.shape)
    power = max(float(np.sum(own**2)), 1e-300)
    residuals = minimum.residuals.reshape(own.shape)
    change = -float(np.sum(own * residuals)) / power
    left = residuals + change * own
    variance_of_noise = np.sum(left**2) / max(fit.solution.freedom - 1, 1) / power
    variance_of_views = np.sum(np.sum(own * left, axis=1) ** 2) / power**2 * views / (views - 1)
    return change, float(np.sqrt(variance_of_noise + variance_of_views))


def tilts(fit: BoardFit) -> tuple[Array, tuple[str, ...]]:
    """Return per used view: degrees between the board's face and the line of sight; which edge is nearer, "" face on.

    Edges as the image shows them.
    """
    points = fit.state.camera_points(fit.observations)
    middle = np.nanmean(np.where(fit.observations.present[..., None], points, np.nan), axis=1)
    sight = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    normal = fit.state.rotations[:, :, 2]
    normal = normal * np.sign(np.sum(normal * sight, axis=1, keepdims=True))  # away from the camera
    cosine = np.sum(normal * sight, axis=1)
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    across = normal - cosine[:, None] * sight
    # Where the normal of the far side points right, the right edge is nearer.
    nearer = tuple(
        edge_towards(x, y) if tilt > MIN_TILT_DEG else ""
        for tilt, (x, y, _) in zip(degrees, across, strict=True)
    )
    return degrees, nearer


@dataclass(frozen=True)
class NextView:
    """The view that would lower the worst expected error most, of those that were considered."""

    text: str
    place_px: tuple[float, float]
    tilt_deg: float
    nearer: str
    worst_before_px: float
    worst_after_px: float

    def to_json(self) -> JsonObject:
        return stated({**vars(self), "place_px": list(self.place_px)})


@dataclass(frozen=True)
class Candidate:
    """A view that could be taken."""

    place: str  # such as "top left"
    pixel: Array  # (2,) of its middle
    nearer: str
    rotation: Array  # (3, 3) camera_from_board
    translation_mm: Array  # (3,)


def next_view(fit: BoardFit) -> NextView | None:
    """Compare a board at nine places of the image, face on and tilted four ways, by what each would show."""
    names = np.array(fit.solution.names)
    of_lens = np.array([name not in WARP for name in names])
    pixels = error_pixels(fit.lens)
    sensitivity = np.zeros((len(pixels), 2, len(names)))
    sensitivity[..., of_lens] = lens_sensitivity(fit.lens, tuple(names[of_lens]), pixels)
    covariance = shared_covariance(fit.solution)
    before = _worst_px(sensitivity, covariance)
    information = np.linalg.pinv(covariance, rcond=1e-15, hermitian=True)
    best = None
    for candidate, gain in zip(*_information_of(fit, _candidates(fit)), strict=True):
        after = _worst_px(
            sensitivity, np.linalg.pinv(information + gain, rcond=1e-15, hermitian=True)
        )
        if np.isfinite(after) and (best is None or after < best.worst_after_px):
            x, y = candidate.pixel
            best = NextView(
                view_instruction(candidate.place, candidate.nearer),
                (float(x), float(y)),
                NEXT_TILT_DEG if candidate.nearer else 0.0,
                candidate.nearer,
                before,
                after,
            )
    return best


def _worst_px(sensitivity: Array, covariance: Array) -> float:
    return float(np.nanmax(expected_px(sensitivity, covariance)))


def _candidates(fit: BoardFit) -> list[Candidate]:
    """Return the views that could be taken: where the lens has rays."""
    size = np.array(tuple(fit.lens.image_size))
    places = _fullest_view(fit).places[0]
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    distance = np.ptp(places[:, 0]) * fit.lens.focal_px / (NEXT_SHARE * size[0])
    candidates = []
    for column, row, nearer in product(range(3), range(3), ("", *EDGES)):
        pixel = ninth_centre(column, row) * size
        ray = fit.lens.rays(pixel)
        if np.isfinite(ray).all():
            rotation = board_rotation(ray, nearer)
            candidates.append(
                Candidate(
                    ninth_name(column, row),
                    pixel,
                    nearer,
                    rotation,
                    ray * distance - rotation @ middle,
                )
            )
    return candidates


def _information_of(fit: BoardFit, candidates: list[Candidate]) -> tuple[list[Candidate], Array]:
    """Return those that show enough corners, and what each would add to the information matrix: (k, n, n)."""
    size, k = np.array(tuple(fit.lens.image_size)), len(candidates)
    state = replace(
        fit.state,
        rotations=np.array([one.rotation for one in candidates]),
        translations_mm=np.array([one.translation_mm for one in candidates]),
    )
    observations = _fullest_view(fit, k)
    with np.errstate(all="ignore"):
        pixels = state.project(observations)
        inside = np.all((pixels > 0) & (pixels < size - 1), axis=-1)
    observations = replace(observations, pixels=np.nan_to_num(pixels), present=inside)
    problem = BoardProblem(
        observations, fit.solution.problem.free, fit.lens.image_size, max(fit.sigma_px, 1e-6)
    )
    _, by_shared, by_pose = problem.linearise(state)
    enough = inside.sum(axis=1) >= MIN_NEXT_CORNERS
    by_shared, by_pose = (
        by_shared.reshape(k, -1, by_shared.shape[-1])[enough],
        by_pose.reshape(k, -1, 6)[enough],
    )
    by_pose_t = by_pose.transpose(0, 2, 1)
    # Its own pose, which must be estimated from it as well, takes up a part of what it shows.
    reduced = by_shared - by_pose @ np.linalg.solve(by_pose_t @ by_pose, by_pose_t @ by_shared)
    return [one for one, ok in zip(candidates, enough, strict=True) if ok], reduced.transpose(
        0, 2, 1
    ) @ reduced


def _fullest_view(fit: BoardFit, times: int = 1) -> BoardObservations:
    """Return the corners of the view that has most, several times over; without pixels."""
    fullest = int(np.argmax(fit.observations.present.sum(axis=1)))
    present = fit.observations.present[fullest]
    places, bow_shape = (
        fit.observations.places[fullest][present],
        fit.observations.bow_shape[fullest][present],
    )
    return BoardObservations(
        np.zeros((times, len(places), 2)),
        np.tile(places, (times, 1, 1)),
        np.ones((times, len(places)), bool),
        np.tile(bow_shape, (times, 1, 1)),
        fit.observations.half_diagonal_mm,
        ("",) * times,
    )
