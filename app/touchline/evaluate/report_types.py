"""What the report of a fit is made of, as JSON. Lengths: mm on the carpet, or at the height named beside them."""

from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from touchline.core.json_values import PointJson
from touchline.core.records import WarningJson
from touchline.core.statements import Stated
from touchline.evaluate.areas import AreaJson
from touchline.fitting.ray_camera.camera_prior import HeightJson

Level = Literal["good", "fair", "poor"]


class FigureLevels(TypedDict):
    """How good each figure is by itself. robot_tops: None for a model that does not correct them."""

    carpet: Level | Literal["unknown"]
    robot_tops: Level | Literal["unknown"] | None


class Verdict(Stated):
    mm: float | None
    level: Level | Literal["unknown"]
    sentence: str
    levels: NotRequired[FigureLevels]  # absent from older reports


class Sag(TypedDict):
    """Eq. (9), before and after correction."""

    before_pct: float | None
    after_pct: float | None


class DistortionReport(Sag):
    kind: Literal["barrel", "pincushion", "none"] | None
    standard_lens_pct: NotRequired[float]
    per_border: dict[str, Sag]


class ErrorFigures(TypedDict):
    z_mm: float
    median: float
    rms: float
    rms_95: float
    max: float
    worst_place: PointJson
    # of robot tops: whether it is a figure and no guess; absent from older reports
    known: NotRequired[bool]


class SigmaReport(ErrorFigures):
    hat: NotRequired[ErrorFigures]  # of models with rays


class ExpectedFigures(TypedDict):
    """Expected error of a report, rms mm: on the carpet, and at robot-top height; None where it is not known."""

    expected_mm: float | None
    expected_hat_mm: float | None
    hat_height_mm: float | None


class RankedModel(ExpectedFigures):
    """field_mm: what it would miss inside the field; apart_mm: how far it is from the reference."""

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


class ModelChoice(Stated):
    """Models, best first, the recommended one's name, and why in a sentence."""

    ranking: list[RankedModel]
    recommended: str | None
    reason: str


class NextClick(TypedDict):
    feature: str
    point: PointJson
    z_mm: float
    worst_mm: float
    worst_mm_then: float


class ResidualRow(TypedDict):
    """From a click to where the model puts it, in the pixels of one picture; null: out of its reach."""

    point: PointJson | None
    foot: PointJson | None
    px: float | None
    mm: float | None
    mm_vector: PointJson | None
    outlier: bool


class FeatureRow(TypedDict):
    feature: str | PointJson
    kind: Literal["line", "landmark"]
    n: int
    used: bool
    rms_px: float | None
    rms_mm: float | None
    max_mm: float | None
    residuals: list[ResidualRow]


class ReportedPose(TypedDict):
    height_mm: float
    tilt_deg: float


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


class BorderDegree(TypedDict):
    degree: int
    reason: str


class ReportedNotes(TypedDict, total=False):
    """How the fit made its choices, of those that its model has."""

    degree: dict[str, BorderDegree]
    relation: dict[str, Any]
    terms: dict[str, Any]
    click_sigma_px: float | None
    degrees_of_freedom: float | None
    parameters: int
    height: HeightJson  # absent where the fit has no rays, and from older versions
    line_offsets_mm: dict[str, float]
    line_offset_sigmas_mm: dict[str, float]
    arc_offsets_mm: dict[str, PointJson]


class FitReport(ReportedNotes):
    rms_px: float | None
    max_px: float | None
    rms_mm: float | None
    max_mm: float | None
    mm_per_px: NotRequired[float | None]
    cv_rms_mm: float | None
    check_rms_mm: NotRequired[float | None]
    inliers: int
    outliers: int
    # None where each border is a curve of its own: no covariance
    sigma_mm: NotRequired[SigmaReport | None]
    distortion: DistortionReport
    per_feature: list[FeatureRow]
    verdict: Verdict
    # that the image shows in place of the chosen one; absent: an older version
    areas: NotRequired[list[AreaJson]]
    next_click: NotRequired[NextClick | None]
    warnings: list[WarningJson]
    camera: NotRequired[ReportedPose | None]  # None: a model without rays; absent: an older version
    covariance: NotRequired[CovarianceJson | None]


class SavedReport(FitReport):
    """Of calibrations that were imported, entries may be absent."""

    model_choice: NotRequired[ModelChoice]  # where the model was "auto"
