"""Expected error over the field, on the carpet and at robot height, by a fit's covariance; and how far a lens reaches.

A covariance of an imported report is checked: a matrix with a negative variance would promise an error of 0 mm, and one
of names that the model does not have would promise that nothing moves.

    Σ_place = G Σ_θ Gᵀ,   G = how a ray's place in the plane moves with the parameters (Sensitivity.field_jacobian)

To first order; it knows the click noise and the priors, and not what the model cannot bend to: held-out error tells
that, so the two are always shown together.

Another camera may stand in for the fitted one, as one lens term does in the league's packet: its error at a place is
then the fit's and the known distance b between the two, e = b + G (θ̂ - θ), and its mean square |b|² + tr(G Σ_θ Gᵀ).

The bound of the verdict: the mean square error over the region, e² = Σ λ_i z_i² with z ~ N(0, 1), has mean Σ λ and is
distributed about as χ²_ν / ν times that, ν = 2 mean² / variance (F. Satterthwaite 1946): so much for the bound that it
keeps in 95 of 100 fits.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Conflict, FitFailed, TouchlineError
from touchline.core.field import Region
from touchline.core.geometry import Array, Points, inside_picture, with_z
from touchline.core.records import Fit, Warning
from touchline.core.statements import say
from touchline.evaluate.report_types import ErrorFigures, SigmaReport
from touchline.evaluate.verdict import tops_are_known
from touchline.fitting import sensitivity_of
from touchline.models import CameraModel, RayModel, model_from_json
from touchline.models.ray_camera import RayCamera

LINE = re.compile(r"line_\d{1,6}")  # a line's own offset, which moves no ray
MAX_VARIANCE = 1e18  # a σ of 10⁹ px, mm or rad: a larger one overflows in products
ASYMMETRY = 1e-6  # of the correlations; rounding leaves 1e-12
NEGATIVE = -1e-6  # of the correlations' least value, likewise

GRID = (13, 11)  # columns, rows over the region
QUANTILE_95 = 1.6449  # of the normal distribution

MARGIN = 0.01  # of the picture's diagonal: so much further out the lens must still reach
HALVINGS = 20


def covariance_from_json(
    value: Any, model: CameraModel
) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    """Names and their matrix (n, n) from a report's "covariance"; Conflict where it is not that model's."""
    try:
        if not isinstance(value, Mapping) or not isinstance(value["names"], (list, tuple)):
            raise ValueError("no covariance")
        names, matrix = tuple(value["names"]), np.array(value["matrix"], float)
        if not (
            _named(names, model)
            and matrix.shape == (len(names), len(names))
            and _is_covariance(matrix)
        ):
            raise ValueError("no covariance of this model")
    except (TypeError, ValueError, KeyError, OverflowError, np.linalg.LinAlgError):
        raise _foreign() from None
    return names, matrix


def fit_from_json(value: Any, model: CameraModel) -> tuple[Fit, RayCamera | None]:
    """Return the fit that tells the model's error, and the model where that is another's: it only stands in for it.

    value: a report's "covariance"; Conflict where it is not that model's.
    """
    names, matrix = covariance_from_json(value, model)
    freer = value.get("freer")
    if not isinstance(freer, Mapping) or not isinstance(model, RayCamera):
        return Fit(model, (), (), covariance=matrix, parameter_names=names), None
    try:
        other = model_from_json(freer["model"], freer["parameters"])
    except (TouchlineError, KeyError, TypeError) as error:
        raise _foreign() from error
    if not isinstance(other, RayCamera):
        raise _foreign()
    names, matrix = covariance_from_json(freer, other)
    return Fit(other, (), (), covariance=matrix, parameter_names=names), model


def _foreign() -> Conflict:
    return Conflict(
        "The covariance in the calibration does not belong to its lens model. The expected error is "
        "unknown.",
        "Calibrate again with its points.",
        reason="foreign-covariance",
    )


def _named(names: tuple[Any, ...], model: CameraModel) -> bool:
    """Each once, all the model's, and not only of lines' offsets."""
    sensitivity = sensitivity_of(model)
    own = set(sensitivity.names) if sensitivity else set()
    return (
        all(isinstance(name, str) and (name in own or LINE.fullmatch(name)) for name in names)
        and len(set(names)) == len(names)
        and any(name in own for name in names)
    )


def _is_covariance(matrix: NDArray[np.float64]) -> bool:
    """Finite, symmetric, and no combination of parameters with a negative variance."""
    variance = np.diag(matrix)
    if not np.isfinite(matrix).all() or np.abs(matrix).max() > MAX_VARIANCE or (variance < 0).any():
        return False
    scale = np.sqrt(np.where(variance > 0, variance, 1.0))
    correlation = matrix / np.outer(scale, scale)
    symmetric = bool(np.abs(correlation - correlation.T).max() <= ASYMMETRY)
    return symmetric and bool(np.linalg.eigvalsh((correlation + correlation.T) / 2)[0] >= NEGATIVE)


@dataclass(frozen=True, eq=False)
class ExpectedError:
    """Expected error (rms of the two axes together, mm) at places (rows, columns, 2) mm of the plane at z_mm.

    NaN where the model does not see the place; the figures are of the others. rms_95: what the rms over these places
    stays under in 95 of 100 such fits.
    """

    places: Points
    sigma_mm: Array
    z_mm: float
    rms_95: float

    @property
    def worst(self) -> tuple[float, list[float]]:
        """The largest, and where."""
        row, column = np.unravel_index(np.nanargmax(self.sigma_mm), self.sigma_mm.shape)
        return float(self.sigma_mm[row, column]), self.places[row, column].tolist()

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.nanmean(self.sigma_mm**2)))

    def to_json(self) -> SigmaReport:
        mm, place = self.worst
        return {
            "z_mm": self.z_mm,
            "median": float(np.nanmedian(self.sigma_mm)),
            "rms": self.rms,
            "rms_95": self.rms_95,
            "max": mm,
            "worst_place": place,
        }


def grid_over(region: Region, columns: int = GRID[0], rows: int = GRID[1]) -> Points:
    """(rows, columns, 2) field mm, corners included, as the region stands in the corrected picture."""
    u, v = np.meshgrid(
        np.linspace(0, region.width_mm, columns), np.linspace(0, region.height_mm, rows)
    )
    return region.field_from_region(np.stack([u, v], axis=-1))


def knows_its_error(fit: Fit) -> bool:
    return fit.covariance is not None and sensitivity_of(fit.model) is not None


def expected_error(
    fit: Fit,
    region: Region,
    z_mm: float = 0.0,
    places: Points | None = None,
    covariance: Array | None = None,
    stand_in: RayCamera | None = None,
) -> ExpectedError:
    """Expected error over the region in the plane at z_mm. covariance: in place of the fit's own.

    stand_in: the camera that is used in place of the fitted one, which is a RayCamera; then only places in the picture
    count.
    """
    places = grid_over(region) if places is None else places
    sensitivity, spread = (
        sensitivity_of(fit.model),
        fit.covariance if covariance is None else covariance,
    )
    if sensitivity is None or spread is None:
        raise Conflict(
            "The expected error cannot be computed for this fit.",
            "Use a physical lens model.",
            reason="no-covariance",
        )
    points = with_z(places.reshape(-1, 2), z_mm)
    by = sensitivity.field_jacobian(points, fit.parameter_names)
    apart = np.zeros((len(points), 2)) if stand_in is None else _apart(fit.model, stand_in, points)
    with np.errstate(invalid="ignore"):
        variance = np.einsum("nik,kl,nil->n", by, spread, by) + np.sum(apart**2, axis=1)
    known = np.isfinite(variance)
    if not known.any():
        raise FitFailed(
            "The fitted camera does not cover any of the area.",
            "Check the line of each point and the covered area.",
            reason="no-camera",
        )
    return ExpectedError(
        places,
        np.sqrt(np.maximum(variance, 0)).reshape(places.shape[:-1]),
        z_mm,
        _rms_95(by[known], spread, apart[known]),
    )


def _apart(model: CameraModel, stand_in: RayCamera, points: Array) -> Points:
    """Return how far the stand-in places what the model sees at points (n, 3) mm; NaN outside the picture."""
    if not isinstance(model, RayCamera):
        raise TypeError("only a camera with a lens can be replaced by another")
    pixels = model.project(points)
    apart = stand_in.unproject(pixels, points[0, 2]) - points[:, :2]
    return np.where(inside_picture(pixels, model.image_size)[:, None], apart, np.nan)


def _rms_95(by: Array, covariance: Array, apart: Points) -> float:
    """Return the 95 % quantile of the rms over places; by (n, 2, p): their derivatives, apart (n, 2) mm."""
    spread = np.einsum("nik,nil->kl", by, by) @ covariance / len(by)
    along = np.einsum("nik,ni->k", by, apart) / len(by)
    mean = float(np.trace(spread) + np.mean(np.sum(apart**2, axis=1)))
    variance = float(2 * np.einsum("kl,lk->", spread, spread) + 4 * along @ covariance @ along)
    if mean <= 0 or variance <= 0:
        return float(np.sqrt(max(mean, 0.0)))
    ninth = variance / (9 * mean**2)  # 2 / (9 ν)
    # E. Wilson, M. Hilferty 1931
    return float(np.sqrt(mean * (1 - ninth + QUANTILE_95 * np.sqrt(ninth)) ** 3))


def sigma_report(
    fit: Fit,
    region: Region,
    robot_top_mm: float,
    height_is_known: bool,
    stand_in: RayCamera | None = None,
) -> SigmaReport | None:
    """Median and largest expected error at the carpet, and under "hat" at robot-top height where there are rays.

    "known" under "hat": whether that is a figure and no guess. height_is_known: of the camera above the carpet.
    stand_in: as in expected_error().
    """
    if not knows_its_error(fit):
        return None
    report = expected_error(fit, region, stand_in=stand_in).to_json()
    if isinstance(fit.model, RayModel):
        hat: ErrorFigures = expected_error(fit, region, robot_top_mm, stand_in=stand_in).to_json()
        hat["known"] = tops_are_known(hat["rms"], height_is_known)
        report["hat"] = hat
    return report


def reach_warnings(model: CameraModel, region: Region, hat_height_mm: float) -> list[Warning]:
    """Warn where the lens ends at or before a place of the region in the picture, on the carpet or at robot tops."""
    if not isinstance(model, RayCamera):
        return []
    flat = grid_over(region).reshape(-1, 2)
    ends = _ends(model, np.concatenate([with_z(flat), with_z(flat, hat_height_mm)])).reshape(2, -1)
    share = float(np.mean(ends.any(axis=0)))
    if not share:
        return []
    return [
        Warning(
            "lens-ends",
            say(
                "warning.lens-ends",
                "The fitted lens folds back inside the image. {share:.0f} % of the field, up to robot-top "
                "height, is at its limit or beyond and has no position.",
                share=100 * share,
            ),
            say(
                "warning.lens-ends.fix",
                "Use the fisheye model, or add points near the corners of the image.",
            ),
        )
    ]


def _ends(model: RayCamera, places: Array) -> Array:
    """Return for each of the places (n, 3) mm whether the picture shows where it is, and the lens does not reach it."""
    size, middle = model.image_size, np.array(model.centre_px)
    rays = (places - np.array(model.position_mm)) @ model.camera_from_field.T
    reached = np.isfinite(model.pixels_from_rays(rays)).all(axis=1)
    if not reached.all():  # of a ray that is not, as far towards it as the lens reaches
        low, high = reached.astype(float), np.ones(len(rays))
        for _ in range(HALVINGS):
            share = (low + high) / 2
            fine = np.isfinite(model.pixels_from_rays(_bent(rays, share))).all(axis=1)
            low, high = np.where(fine, share, low), np.where(fine, high, share)
        rays = _bent(rays, low)
    pixels = model.pixels_from_rays(rays)
    with np.errstate(all="ignore"):
        outwards = (pixels - middle) / np.linalg.norm(pixels - middle, axis=1, keepdims=True)
    further = np.clip(pixels + outwards * MARGIN * np.hypot(*size), 0, np.array(tuple(size)) - 1.0)
    beyond = ~np.isfinite(model.rays(further)).all(axis=1)
    return inside_picture(pixels, size) & (rays[:, 2] > 0) & (~reached | beyond)


def _bent(rays: Array, share: Array) -> Array:
    """Return rays (n, 3) turned towards the axis, their tangents a share (n,) of what they were."""
    return rays * np.stack([share, share, np.ones_like(share)], axis=1)
