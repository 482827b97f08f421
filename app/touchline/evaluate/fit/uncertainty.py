"""Expected error over the field, at the carpet and at hat height, from what the fit knows of its parameters.

    Σ_place = G Σ_θ Gᵀ,   G = how a ray's place in the plane moves with the parameters (Sensitivity.field_jacobian)

To first order; it knows the click noise and the priors, and not what the model cannot bend to: held-out error tells
that, so the two are always shown together.

Another camera may stand in for the fitted one, as one lens term does in the league's packet: its error at a place is
then the fit's and the known distance b between the two, e = b + G (θ̂ - θ), and its mean square |b|² + tr(G Σ_θ Gᵀ).

The mean square error over the region, e² = Σ λ_i z_i² with z ~ N(0, 1), has mean Σ λ and is distributed about as
χ²_ν / ν times that, ν = 2 mean² / variance (F. Satterthwaite 1946): so much for the bound that it keeps in 95 of 100
fits.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.errors import Conflict, FitFailed
from touchline.core.field import Region
from touchline.core.geometry import Array, Points, inside_picture, with_z
from touchline.core.records import Fit
from touchline.evaluate.fit.report_types import ErrorFigures, SigmaReport
from touchline.evaluate.fit.verdict import tops_are_known
from touchline.fitting import sensitivity_of
from touchline.models import CameraModel, RayModel
from touchline.models.ray_camera import RayCamera

GRID = (13, 11)  # columns, rows over the region
QUANTILE_95 = 1.6449  # of the normal distribution


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
        return {"z_mm": self.z_mm, "median": float(np.nanmedian(self.sigma_mm)), "rms": self.rms, "rms_95": self.rms_95,
                "max": mm, "worst_place": place}


def grid_over(region: Region, columns: int = GRID[0], rows: int = GRID[1]) -> Points:
    """(rows, columns, 2) field mm, corners included, as the region stands in the corrected picture."""
    u, v = np.meshgrid(np.linspace(0, region.width_mm, columns), np.linspace(0, region.height_mm, rows))
    return region.field_from_region(np.stack([u, v], axis=-1))


def knows_its_error(fit: Fit) -> bool:
    return fit.covariance is not None and sensitivity_of(fit.model) is not None


def expected_error(fit: Fit, region: Region, z_mm: float = 0.0, places: Points | None = None,
                   covariance: Array | None = None, stand_in: RayCamera | None = None) -> ExpectedError:
    """Expected error over the region in the plane at z_mm. covariance: in place of the fit's own.

    stand_in: the camera that is used in place of the fitted one, which is a RayCamera; then only places in the picture
    count.
    """
    places = grid_over(region) if places is None else places
    sensitivity, spread = sensitivity_of(fit.model), fit.covariance if covariance is None else covariance
    if sensitivity is None or spread is None:
        raise Conflict("The expected error cannot be computed for this fit.", "Use a physical lens model.",
                       reason="no-covariance")
    points = with_z(places.reshape(-1, 2), z_mm)
    by = sensitivity.field_jacobian(points, fit.parameter_names)
    apart = np.zeros((len(points), 2)) if stand_in is None else _apart(fit.model, stand_in, points)
    with np.errstate(invalid="ignore"):
        variance = np.einsum("nik,kl,nil->n", by, spread, by) + np.sum(apart**2, axis=1)
    known = np.isfinite(variance)
    if not known.any():
        raise FitFailed("The fitted camera does not cover any of the area.",
                        "Check the line of each point and the covered area.", reason="no-camera")
    return ExpectedError(places, np.sqrt(np.maximum(variance, 0)).reshape(places.shape[:-1]), z_mm,
                         _rms_95(by[known], spread, apart[known]))


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
    return float(np.sqrt(mean * (1 - ninth + QUANTILE_95 * np.sqrt(ninth)) ** 3))  # E. Wilson, M. Hilferty 1931


def sigma_report(fit: Fit, region: Region, hat_mm: float, height_is_known: bool,
                 stand_in: RayCamera | None = None) -> SigmaReport | None:
    """Median and largest expected error at the carpet, and under "hat" at hat height where there are rays.

    "known" under "hat": whether that is a figure and no guess. height_is_known: of the camera above the carpet.
    stand_in: as in expected_error().
    """
    if not knows_its_error(fit):
        return None
    report = expected_error(fit, region, stand_in=stand_in).to_json()
    if isinstance(fit.model, RayModel):
        hat: ErrorFigures = expected_error(fit, region, hat_mm, stand_in=stand_in).to_json()
        hat["known"] = tops_are_known(hat["rms"], height_is_known)
        report["hat"] = hat
    return report
