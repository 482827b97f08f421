"""What is known of two cameras that see the same, as JSON: of each part, and of all together."""

from typing import Literal

from typing_extensions import TypedDict

from touchline.core.errors import ProblemJson
from touchline.core.json_values import PointsJson
from touchline.evaluate.cameras.pair_agreement import AgreementFigures
from touchline.evaluate.cameras.rig_verdict import PairVerdict

PartName = Literal["fundamental", "pose", "calibrated", "agreement"]


class FundamentalJson(TypedDict):
    """From matches alone. epipoles: homogeneous, in picture a and in b."""

    matrix: list[list[float]]
    rms_px: float
    sigma_px: float
    epipolar_px: list[float | None]
    outliers: list[int]
    epipoles: list[list[float]]
    verdict: PairVerdict


class Turn(TypedDict):
    """A rotation: about camera b's axes (right, down, ahead), and altogether."""

    rotation_deg: list[float]
    angle_deg: float


class PoseDifference(TypedDict):
    rotation: float
    direction: float | None  # None for two cameras at one place


class PoseJson(Turn):
    """The pose of camera a in camera b's frame, from matches and lenses; how far it is from the calibrations'."""

    rotation: list[float]
    direction: list[float]
    rotation_sigma_deg: float
    direction_sigma_deg: float
    from_calibrations_deg: PoseDifference
    essential: list[list[float]]
    rms_px: float
    epipolar_px: list[float | None]
    outliers: list[int]
    verdict: PairVerdict


class CalibratedJson(Turn):
    """How far matches are from the epipolar lines by two calibrations, px; camera a in camera b's frame, mm."""

    median_px: float
    rms_px: float
    epipolar_px: list[float | None]
    translation_mm: list[float]
    distance_mm: float
    verdict: PairVerdict


_AgreementSource = TypedDict("_AgreementSource", {"from": Literal["clicks", "matches"]})


class PairAgreement(AgreementFigures, _AgreementSource):
    """apart_mm: of each match, null where it has no height."""

    apart_mm: list[float | None] | None
    verdict: PairVerdict


class FailedPart(ProblemJson):
    part: PartName


class PairReport(TypedDict):
    """Each part is null where it was not asked for, or could not be had; lists have one value for each match."""

    fundamental: FundamentalJson | None
    pose: PoseJson | None
    calibrated: CalibratedJson | None
    agreement: PairAgreement | None
    matches: int
    failed: list[FailedPart]


class PairLines(TypedDict):
    """Epipolar lines in picture a of the points in b, and the reverse, null where nowhere in the picture or without
    rays; place_in_b: where picture b shows what picture a shows at its points, if that is at the height."""

    in_a: list[PointsJson | None] | None
    in_b: list[PointsJson | None] | None
    place_in_a: PointsJson | None
    place_in_b: PointsJson | None
