"""Calibrations as they are kept, exported, judged and compared."""

from typing import Any, Literal

from app.api.schemas.responses.base import Answer, Page, Point, Points
from app.api.schemas.responses.fits import FittedModel, Report


class Calibration(Answer):
    id: str
    version: int
    camera: str | None
    field: str
    region: str
    rotate: int
    model: FittedModel
    image_size: list[int]
    corrected_size: list[int]
    observations: list[dict[str, Any]]
    options: dict[str, Any]
    report: Report
    created_at: str
    software: str
    snapshot: str | None
    image_sha256: str | None
    parent: str | None
    note: str
    made_by: str
    active: bool
    field_definition: dict[str, Any]


class Calibrations(Page):
    items: list[Calibration]


class Ranking(Answer):
    ranking: list[dict[str, Any]]
    recommended: str | None
    reason: str
    failed: list[dict[str, Any]]


class Format(Answer):
    """One export: what it can hold, whether it holds this calibration exactly, else what the nearest costs."""

    format: str
    title: str
    holds: str
    suffix: str
    reads: bool
    exact: bool
    loss: dict[str, Any] | None
    problem: dict[str, Any] | None


class Formats(Answer):
    items: list[Format]


class Uncertainty(Answer):
    z_mm: float
    median: float
    rms: float
    max: float
    worst_place: Point
    grid: dict[str, Any]


class Difference(Answer):
    rms_mm: float | None
    median_mm: float | None
    max_mm: float | None
    worst_place: Point | None
    rms_px: float | None
    max_px: float | None
    grid: dict[str, Any] | None


class CalibrationReport(Answer):
    format: Literal["touchline-report"]
    format_version: Literal[1]
    calibration: dict[str, Any]
    field: dict[str, Any]
    model: dict[str, Any]
    picture: dict[str, Any]
    verdict: dict[str, Any]
    figures: dict[str, dict[str, Any]]
    distortion: dict[str, Any]
    per_feature: list[dict[str, Any]]
    outliers: list[dict[str, Any]]
    uncertainty: dict[str, Any]
    warnings: list[dict[str, Any]]


class Transformed(Answer):
    points: Points
