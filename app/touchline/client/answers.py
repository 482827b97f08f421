"""What the calls of the client answer. Written from the REST description by tests/support/client_types.py."""

from typing import Any, Literal, NotRequired, TypedDict


class Snapshot(TypedDict):
    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str
    sha256: str
    format: str
    purpose: str
    name: str


class Job(TypedDict):
    id: str
    kind: str
    created_at: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: float
    message: str
    result: Any
    problem: dict[str, Any] | None
    ended_at: str | None
    attempt: int
    statements: NotRequired[dict[str, Any]]


class ModelParameters(TypedDict):
    name: str
    parameters: dict[str, Any]


class ObservationJson(TypedDict):
    feature: str | list[float]
    kind: Literal["line", "landmark"]
    points: list[list[float]]
    z_mm: NotRequired[float]


class AreaJson(TypedDict):
    """region, rotate: as they are chosen; seen_share: of its carpet, in the picture."""

    region: str
    rotate: int
    seen_share: float


class BorderDegree(TypedDict):
    degree: int
    reason: str


class FreerFit(TypedDict):
    """A lens that bends freely, fitted to the same points: it tells the error of a lens with one term."""

    model: str
    parameters: dict[str, Any]
    names: list[str]
    matrix: list[list[float]]


class CovarianceJson(TypedDict):
    names: list[str]
    matrix: list[list[float]]
    freer: NotRequired[FreerFit]


class Sag(TypedDict):
    """Eq. (9), before and after correction."""

    before_pct: float | None
    after_pct: float | None


class DistortionReport(TypedDict):
    before_pct: float | None
    after_pct: float | None
    kind: Literal["barrel", "pincushion", "none"] | None
    standard_lens_pct: NotRequired[float]
    per_border: dict[str, Sag]


class ResidualRow(TypedDict):
    """From a click to where the model puts it, in the pixels of one picture; null: out of its reach."""

    point: list[float] | None
    foot: list[float] | None
    px: float | None
    mm: float | None
    mm_vector: list[float] | None
    outlier: bool


class FeatureRow(TypedDict):
    feature: str | list[float]
    kind: Literal["line", "landmark"]
    n: int
    used: bool
    rms_px: float | None
    rms_mm: float | None
    max_mm: float | None
    residuals: list[ResidualRow]


class HeightJson(TypedDict):
    """The camera's height: as entered, as the points alone have it, and how many σ of both they are apart. state:
    "estimated" where none was entered, "not-checked" where the points cannot tell a tenth of it."""

    entered_mm: float | None
    entered_sigma_mm: float | None
    points_mm: float | None
    points_sigma_mm: float | None
    sigmas: float | None
    state: Literal["agrees", "contradicted", "not-checked", "estimated"]


class FigureLevels(TypedDict):
    """How good each figure is by itself. robot_tops: None for a model that does not correct them."""

    carpet: Literal["good", "fair", "poor"] | Literal["unknown"]
    robot_tops: Literal["good", "fair", "poor"] | Literal["unknown"] | None


class Verdict(TypedDict):
    statements: NotRequired[dict[str, Any]]
    mm: float | None
    level: Literal["good", "fair", "poor"] | Literal["unknown"]
    sentence: str
    levels: NotRequired[FigureLevels]


class RankedModel(TypedDict):
    """field_mm: what it would miss inside the field; apart_mm: how far it is from the reference."""

    expected_mm: float | None
    expected_hat_mm: float | None
    hat_height_mm: float | None
    model: str
    title: str
    parameters: int
    held_out_mm: float | None
    check_mm: float | None
    apart_mm: float | None
    field_mm: float | None
    rms_px: float | None
    verdict: Verdict
    warnings: list[str]


class ModelChoice(TypedDict):
    """Models, best first, the recommended one's name, and why in a sentence."""

    statements: NotRequired[dict[str, Any]]
    ranking: list[RankedModel]
    recommended: str | None
    reason: str


class NextClick(TypedDict):
    feature: str
    point: list[float]
    z_mm: float
    worst_mm: float
    worst_mm_then: float


class ReportedPose(TypedDict):
    height_mm: float
    tilt_deg: float


class ErrorFigures(TypedDict):
    z_mm: float
    median: float
    rms: float
    rms_95: float
    max: float
    worst_place: list[float]
    known: NotRequired[bool]


class SigmaReport(TypedDict):
    z_mm: float
    median: float
    rms: float
    rms_95: float
    max: float
    worst_place: list[float]
    known: NotRequired[bool]
    hat: NotRequired[ErrorFigures]


class WarningJson(TypedDict):
    statements: NotRequired[dict[str, Any]]
    reason: str
    text: str
    fix: str
    feature: str | None
    index: int | None


class SavedReport(TypedDict):
    """Of calibrations that were imported, entries may be absent."""

    degree: NotRequired[dict[str, BorderDegree]]
    relation: NotRequired[dict[str, Any]]
    terms: NotRequired[dict[str, Any]]
    click_sigma_px: NotRequired[float | None]
    degrees_of_freedom: NotRequired[float | None]
    parameters: NotRequired[int]
    height: NotRequired[HeightJson]
    line_offsets_mm: NotRequired[dict[str, float]]
    line_offset_sigmas_mm: NotRequired[dict[str, float]]
    arc_offsets_mm: NotRequired[dict[str, list[float]]]
    rms_px: float | None
    max_px: float | None
    rms_mm: float | None
    max_mm: float | None
    mm_per_px: NotRequired[float | None]
    cv_rms_mm: float | None
    check_rms_mm: NotRequired[float | None]
    inliers: int
    outliers: int
    sigma_mm: NotRequired[SigmaReport | None]
    distortion: DistortionReport
    per_feature: list[FeatureRow]
    verdict: Verdict
    areas: NotRequired[list[AreaJson]]
    next_click: NotRequired[NextClick | None]
    warnings: list[WarningJson]
    camera: NotRequired[ReportedPose | None]
    covariance: NotRequired[CovarianceJson | None]
    model_choice: NotRequired[ModelChoice]


class Calibration(TypedDict):
    id: str
    version: int
    camera: str | None
    field: str
    region: str
    rotate: int
    model: ModelParameters
    image_size: list[int]
    corrected_size: list[int]
    observations: list[ObservationJson]
    options: dict[str, Any]
    report: SavedReport
    created_at: str
    software: str
    snapshot: str | None
    image_sha256: str | None
    parent: str | None
    note: str
    made_by: str
    active: bool
    field_definition: dict[str, Any]
