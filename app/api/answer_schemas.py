"""What answers look like, for the documentation: the routes send their JSON as it is, tests hold it to this."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

Point = list[float]
Points = list[Point | None]  # null: out of reach


class Answer(BaseModel):
    """Entries may be added, and are never renamed."""

    model_config = ConfigDict(extra="allow")


class Health(Answer):
    status: Literal["ok"]
    version: str
    uptime_s: float
    warnings: list[dict[str, Any]]
    damaged: list[dict[str, Any]]


class Page(Answer):
    """Newest first; next_cursor asks for the ones after, null at the end."""

    next_cursor: str | None


class Snapshot(Answer):
    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str
    sha256: str
    purpose: str


class Snapshots(Page):
    items: list[Snapshot]


class Camera(Answer):
    id: str
    name: str
    field: str | None
    region: str | None
    source: str
    editable: bool
    active_calibration: str | None


class Cameras(Page):
    items: list[Camera]


class CameraTest(Answer):
    width: int
    height: int
    fps: float
    identity: dict[str, str] | None
    picture: str


class FoundCameras(Answer):
    items: list[dict[str, Any]]


class Sources(Answer):
    items: list[dict[str, Any]]


class Controls(Answer):
    items: list[dict[str, Any]]


class CameraStatus(Answer):
    state: Literal["connecting", "live", "stalled", "offline", "mismatch"]
    problem: dict[str, Any] | None
    fps: float
    width: int | None
    height: int | None
    frame_age_s: float | None
    reconnects: int
    light: dict[str, Any] | None
    sharpness: Any
    active_calibration: str | None
    drift_px: float | None


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


class Job(Answer):
    id: str
    kind: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: float
    message: str
    result: Any
    problem: dict[str, Any] | None
    created_at: str
    ended_at: str | None
    attempt: int


class Jobs(Page):
    items: list[Job]


class LensInShort(Answer):
    id: str
    created_at: str
    camera: str | None
    note: str
    model: str
    board: dict[str, Any] | None
    image_size: list[int]


class Lens(LensInShort):
    lens: dict[str, Any]
    report: dict[str, Any]
    snapshots: list[str] | None
    software: str


class Lenses(Page):
    items: list[LensInShort]


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


class Pair(Answer):
    fundamental: dict[str, Any] | None
    pose: dict[str, Any] | None
    calibrated: dict[str, Any] | None
    agreement: dict[str, Any] | None
    matches: int
    failed: list[dict[str, Any]]


class PairLines(Answer):
    in_a: list[list[Point | None] | None] | None
    in_b: list[list[Point | None] | None] | None
    place_in_a: Points | None
    place_in_b: Points | None


class Straightness(Answer):
    lens: dict[str, Any]
    sigma: dict[str, float]
    straightness_px: dict[str, float]
    bow: dict[str, Any]
    distortion: Literal["significant", "none", "unknown"]
    sentence: str
    lines: list[dict[str, Any]]
    lines_used: int
    objects: int
    pictures: list[str]
    cannot_see: str


class Transformed(Answer):
    points: Points
