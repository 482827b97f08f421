"""What a fit starts from: fields, models and drafts; what it finds at once."""

from typing import Any, Literal

from app.api.schemas.responses.base import Answer, Page, Point, Points


class Field(Answer):
    name: str
    title: str
    length_mm: float
    width_mm: float
    lines: list[dict[str, Any]]
    arcs: list[dict[str, Any]]
    landmarks: dict[str, Point]
    hat_height_mm: float
    regions: dict[str, dict[str, Any]]


class Fields(Page):
    items: list[Field]


class Option(Answer):
    name: str
    type: str
    default: Any
    help: str
    range: list[float] | None
    unit: str | None
    choices: list[str]


class Model(Answer):
    name: str
    title: str
    help: str
    points_needed: str
    options: list[Option]


class Models(Page):
    items: list[Model]


class Draft(Answer):
    field: str | None
    region: str | None
    rotate: int | None
    model: str | None
    options: dict[str, Any]
    observations: list[dict[str, Any]]
    updated_at: str | None


class Border(Answer):
    degree: int
    degree_reason: str
    coefficients: list[float]
    rms_px: float
    loo_rms_px: float | None
    residuals_px: list[float]
    outliers: list[int]
    curve: list[Point]
    distortion_pct: float
    kind: str | None


class FittedModel(Answer):
    name: str
    parameters: dict[str, Any]


class Report(Answer):
    rms_px: float | None
    max_px: float | None
    rms_mm: float | None
    max_mm: float | None
    cv_rms_mm: float | None
    inliers: int
    outliers: int
    distortion: dict[str, Any]
    per_feature: list[dict[str, Any]]
    verdict: dict[str, Any]
    warnings: list[dict[str, Any]]


class Drawn(Answer):
    feature: str
    kind: Literal["border", "line", "arc", "landmark"]
    points: Points


class SnappedPoint(Answer):
    state: Literal["snapped", "kept"]
    point: Point


class SnappedPoints(Answer):
    points: list[SnappedPoint]


class Overlay(Answer):
    features: list[Drawn]


class Arrows(Answer):
    frame: Literal["raw", "corrected"]
    mm_per_px: float | None
    arrows: list[dict[str, Any]]


class Preview(Answer):
    model: FittedModel
    report: Report
    corrected_size: list[int]
    overlay: list[Drawn]
