"""The main flow: observations → fit → report, and what a model is used for: transforms, pictures, overlays, maps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.field import BORDERS, Arc, Field, Line, Region
from touchline.core.geometry import ImageSize, Points, as_points
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import PointJson, PointsJson, SizeJson, nullable, nullable_points
from touchline.core.records import Fit, Observations
from touchline.core.sentences import CALIBRATE_THIS_SIZE, other_image_size
from touchline.core.statements import Stated, say, stated
from touchline.evaluate import residuals
from touchline.evaluate.cross_validation import held_out_mm
from touchline.evaluate.difference import (
    Difference,
    DifferenceGrid,
    bends_otherwise,
    contradiction,
    difference_report,
    freer_lens,
)
from touchline.evaluate.distortion import distortion_kind, sag_pct
from touchline.evaluate.report import report
from touchline.evaluate.report_types import ErrorFigures, FitReport
from touchline.evaluate.residuals import ResidualVectors
from touchline.evaluate.uncertainty import expected_error, fit_from_json, grid_over
from touchline.fitting import FITTERS, sensitivity_of
from touchline.fitting.border import Degree, fit_curve
from touchline.imaging.correction import CorrectedView, MeshHeader, correction_map
from touchline.imaging.heat_map import heat_map
from touchline.models import CameraModel, RayModel, raw_from_field
from touchline.models.polynomial import MAX_DEGREE

Marking = Literal["border", "line", "arc", "landmark"]

SPACES = ("image", "corrected", "field")
CURVE_POINTS = 65  # a border drawn with so many is smooth on any screen
OVERLAY_STEP_MM = 50.0
OVERLAY_STEP_DEG = 4.0
WHOLE_REGION = CorrectedView()


class Polyline(TypedDict):
    feature: str
    kind: Marking
    points: PointsJson


class BorderFit(Stated):
    degree: int
    degree_reason: str
    coefficients: list[float]
    rms_px: float
    loo_rms_px: float | None
    residuals_px: list[float]
    outliers: list[int]
    curve: list[PointJson]
    distortion_pct: float
    kind: Literal["barrel", "pincushion", "none"] | None


class ModelParameters(TypedDict):
    name: str
    parameters: Mapping[str, Any]


class PreviewMesh(MeshHeader):
    """The corrected view, its nodes in base64 as raw_px, and the field in it."""

    raw_px: str
    overlay: list[Polyline]


class Preview(TypedDict):
    model: ModelParameters
    report: FitReport
    corrected_size: SizeJson
    overlay: list[Polyline]
    mesh: PreviewMesh | None


class Attempt(TypedDict):
    """refusal: why it cannot be fitted: reason, title, what, fix, and which."""

    preview: Preview | None
    refusal: dict[str, Any] | None


class ResidualArrows(ResidualVectors):
    frame: Literal["raw", "corrected"]


class ErrorGrid(TypedDict):
    places: list[list[PointJson]]
    sigma_mm: list[list[float | None]]


class Uncertainty(ErrorFigures):
    grid: ErrorGrid


Space = Literal["image", "corrected", "field"]


@dataclass(frozen=True)
class CalibrationResult:
    """A fit with its report."""

    fit: Fit
    report: FitReport

    @property
    def model(self) -> CameraModel:
        return self.fit.model


def calibrate(
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    model: str = "polynomial",
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
    *,
    cross_validate: bool = True,
    freer: Callable[[], Fit | None] | None = None,
    fitted: Fit | None = None,
) -> CalibrationResult:
    """Fit a model to the observations and evaluate it. cross_validate=False is quick, for while a point is dragged.

    freer: how to find the lens that another model is held against, where that was done before. fitted: the fit, where
    it is made already.
    """
    for observation in observations:
        # an unknown name is refused before anything is computed
        field.feature(observation.feature, region)
    first, second = subprogress(progress, 0.0, 0.5), subprogress(progress, 0.5, 1.0)
    fit = fitted or FITTERS[model].fit(observations, field, region, image_size, options, first)
    if not cross_validate:
        return CalibrationResult(fit, report(fit, observations, field, region, None))
    held_out = held_out_mm(fit, observations, field, region, image_size, options, second)
    other = None
    if bends_otherwise(fit, options):
        other = freer() if freer else freer_lens(observations, field, region, image_size, options)
    apart = contradiction(fit, other, observations, field, region) if other is not None else None
    return CalibrationResult(fit, report(fit, observations, field, region, held_out, apart))


def uncertainty(
    model: CameraModel,
    covariance: Any,
    region: Region,
    z_mm: float = 0.0,
    columns: int = 25,
    rows: int = 19,
) -> Uncertainty:
    """Expected field error in the plane at z_mm over a grid, as plain JSON.

    covariance: a report's, possibly imported; Conflict where it is not this model's.
    """
    if covariance is None or sensitivity_of(model) is None:
        raise Conflict(
            f"{model.TITLE}: the expected error is unknown, because this calibration has no "
            "covariance."
            if covariance is None
            else f"{model.TITLE}: the expected error cannot be computed for this model.",
            "Use a physical lens model. The cross-validated error is available for every model.",
            reason="no-covariance",
        )
    if z_mm != 0 and not isinstance(model, RayModel):
        raise Conflict(
            f"{model.TITLE}: positions are available on the carpet only, not {z_mm:g} mm above it.",
            "Use a physical lens model, or z_mm 0.",
            reason="no-rays",
        )
    fit, stand_in = fit_from_json(covariance, model)
    sigma = expected_error(fit, region, z_mm, grid_over(region, columns, rows), stand_in=stand_in)
    figures: ErrorFigures = sigma.to_json()
    return {
        **figures,
        "grid": {"places": sigma.places.tolist(), "sigma_mm": nullable(sigma.sigma_mm)},
    }


def difference(one: CameraModel, other: CameraModel, region: Region) -> Difference:
    """How far two calibrations of one picture are apart over the region, in mm and px, as plain JSON."""
    if tuple(one.image_size) != tuple(other.image_size):
        raise Conflict(
            say("difference.sizes", "The two calibrations are for images of different sizes."),
            say("difference.sizes.fix", "Compare calibrations of one camera at one resolution."),
            reason="size-mismatch",
        )
    return difference_report(one, other, region)


def difference_grid(found: Difference) -> DifferenceGrid:
    """Return its grid; FitFailed where there is none."""
    if found["grid"] is None:
        raise FitFailed(
            "The two calibrations have no part of the region in common.",
            "Choose two calibrations of one camera.",
            reason="no-overlap",
        )
    return found["grid"]


def error_map_image(
    values: Sequence[Sequence[float | None]], region: Region, title: str
) -> NDArray[np.uint8]:
    """Draw a grid of millimetres over the region as a picture with a scale."""
    width = 640
    return heat_map(
        np.array(values, float),
        width=width,
        height=round(width * region.height_mm / region.width_mm),
        unit="mm",
        title=title,
    )


def fit_border(
    points: Points, axis: str, degree: Degree, image_size: ImageSize | None = None
) -> BorderFit:
    """Fit one border: its curve, residuals and distortion, as plain JSON.

    axis: "x_of_y" for a border that runs down the picture, "y_of_x" for one across it. With image_size the curve
    spans the picture and the distortion is signed, its middle taken for the inside; without, it is a magnitude.
    """
    if axis not in ("x_of_y", "y_of_x"):
        raise BadInput(
            f"{axis!r} is not an axis of a border.", "Use x_of_y or y_of_x.", reason="bad-axis"
        )
    if degree != "auto" and (
        isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= MAX_DEGREE
    ):
        raise BadInput(
            f"A border cannot have the degree {degree!r}.",
            f'Use 1 to {MAX_DEGREE}, or "auto".',
            reason="bad-option",
        )
    points = as_points(points, "The border's points").reshape(-1, 2)
    run = 1 if axis == "x_of_y" else 0
    position, value = points[:, run], points[:, 1 - run]
    ends = (float(position.min()), float(position.max())) if len(points) else (0.0, 1.0)
    span = (
        (-0.5, tuple(image_size)[run] - 0.5) if image_size else (ends[0], max(ends[1], ends[0] + 1))
    )
    fitted = fit_curve(position, value, degree, span, None)
    start, end = span if image_size else ends
    drawn = np.linspace(start, end, CURVE_POINTS)
    between = np.linspace(*ends, CURVE_POINTS)
    inside = np.array(image_size.centre) if image_size else None
    pct = sag_pct(
        _along(between, fitted.curve(between), run), inside if inside is not None else points[0]
    )
    return stated(
        BorderFit(
            degree=fitted.curve.degree,
            degree_reason=fitted.reason,
            coefficients=list(fitted.curve.plain_coefficients()),
            rms_px=fitted.rms,
            loo_rms_px=fitted.held_out_rms,
            residuals_px=fitted.residuals.tolist(),
            outliers=np.flatnonzero(~fitted.inliers).tolist(),
            curve=_along(drawn, fitted.curve(drawn), run).tolist(),
            distortion_pct=pct if image_size else abs(pct),
            kind=distortion_kind(pct) if image_size else None,
        )
    )


def _along(position: NDArray, value: NDArray, run: int) -> Points:
    return np.stack([position, value] if run == 0 else [value, position], axis=-1)


def transform(
    model: CameraModel, points: Points, source: Space, target: Space, z_mm: float = 0.0
) -> Points:
    """Points (..., 2) from one space to another; NaN where the model does not reach.

    z_mm: height of the field's end above the carpet. A corrected picture shows what it shows on the carpet, so its
    pixels reach another height by way of the raw picture.
    """
    for space in (source, target):
        if space not in SPACES:
            raise BadInput(
                f"There is no space called {space!r}.",
                "Use image, corrected or field.",
                reason="unknown-space",
            )
    points = as_points(points)
    if z_mm != 0 and (source == "field") != (target == "field"):
        return _transform_at_height(model, points, source, target, z_mm)
    to_corrected = {
        "image": model.corrected_from_raw,
        "corrected": lambda p: p,
        "field": model.corrected_from_field,
    }
    from_corrected = {
        "image": model.raw_from_corrected,
        "corrected": lambda p: p,
        "field": model.field_from_corrected,
    }
    return from_corrected[target](to_corrected[source](points))


def _transform_at_height(
    model: CameraModel, points: Points, source: Space, target: Space, z_mm: float
) -> Points:
    if not isinstance(model, RayModel):
        raise Conflict(
            f"{model.TITLE}: positions are available on the carpet only, not {z_mm:g} mm above it.",
            "Use a physical lens model, or z_mm 0.",
            reason="no-rays",
        )
    if source == "field":
        raw = model.project(
            np.concatenate([points, np.full((*points.shape[:-1], 1), z_mm)], axis=-1)
        )
        return raw if target == "image" else model.corrected_from_raw(raw)
    return model.unproject(points if source == "image" else model.raw_from_corrected(points), z_mm)


def correct(
    pixels: NDArray[np.uint8],
    model: CameraModel,
    image_size: ImageSize,
    view: CorrectedView = WHOLE_REGION,
    progress: Progress = no_progress,
) -> NDArray[np.uint8]:
    """Correct a raw picture that has the calibration's own size."""
    check_size(ImageSize(pixels.shape[1], pixels.shape[0]), image_size)
    return correction_map(model, view, progress).apply_finely(pixels)


def check_size(size: ImageSize, wanted: ImageSize) -> None:
    """Refuse a picture of another size: a calibration holds for one size only."""
    if size != wanted:
        raise Conflict(other_image_size(size, wanted), CALIBRATE_THIS_SIZE, reason="size-mismatch")


def overlay(
    model: CameraModel,
    field: Field,
    region: Region,
    frame: Literal["raw", "corrected"] = "raw",
    view: CorrectedView | None = None,
) -> list[Polyline]:
    """The region's borders and all that is painted on the field, as polylines; None where out of reach.

    In raw pixels, or in those of a corrected view.
    """
    borders = {name: region.border(name) for name in BORDERS}
    tables: tuple[tuple[Marking, Mapping[str, Line | Arc]], ...] = (
        ("border", borders),
        ("line", field.lines),
        ("arc", field.arcs),
    )
    drawn = [
        (kind, name, shape.sample(_steps(shape)))
        for kind, table in tables
        for name, shape in table.items()
    ]
    drawn += [
        ("landmark", mark.name, np.array([mark.position])) for mark in field.landmarks.values()
    ]
    return [
        {
            "feature": name,
            "kind": kind,
            "points": nullable_points(_seen(model, points, frame, view)),
        }
        for kind, name, points in drawn
    ]


def _steps(shape: Line | Arc) -> int:
    """How many points draw it smoothly: a line bends only through the lens, an arc by itself as well."""
    by_angle = (
        abs(shape.end_deg - shape.start_deg) / OVERLAY_STEP_DEG if isinstance(shape, Arc) else 0
    )
    return max(2, min(400, 1 + round(max(shape.length_mm / OVERLAY_STEP_MM, by_angle))))


def _seen(
    model: CameraModel, field_points: Points, frame: str, view: CorrectedView | None
) -> Points:
    if frame == "raw":
        return raw_from_field(model, field_points)
    corrected = model.corrected_from_field(field_points)
    return corrected if view is None else view.view_from_corrected(model, corrected)


def residual_vectors(
    model: CameraModel,
    observations: Observations,
    field: Field,
    region: Region,
    strays: Sequence[NDArray[np.bool_]],
    frame: Literal["raw", "corrected"] = "raw",
    view: CorrectedView = WHOLE_REGION,
) -> ResidualArrows:
    """Residuals as vectors in raw pixels or in those of a corrected view."""

    def seen(raw: Points) -> Points:
        return (
            raw
            if frame == "raw"
            else view.view_from_corrected(model, model.corrected_from_raw(raw))
        )

    return {
        **residuals.residual_vectors(model, observations, field, region, strays, seen),
        "frame": frame,
    }
