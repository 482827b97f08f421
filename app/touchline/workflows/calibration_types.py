"""What fits and their previews are made of, as JSON. Points: raw px, except in a corrected view."""

from collections.abc import Mapping
from typing import Any, Literal

from typing_extensions import TypedDict

from touchline.core.json_values import PointJson, PointsJson, SizeJson
from touchline.core.statements import Stated
from touchline.evaluate.report_types import ErrorFigures, FitReport
from touchline.evaluate.residuals import ResidualVectors
from touchline.imaging.correction import MeshHeader

Marking = Literal["border", "line", "arc", "landmark"]


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
