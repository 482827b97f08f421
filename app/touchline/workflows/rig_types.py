"""What is known of a rig of cameras, as JSON: its state, and how far its cameras agree."""

from typing import Literal, final

from typing_extensions import TypedDict

from touchline.core.errors import ProblemJson
from touchline.evaluate.cameras.epipolar_check import PredictedGeometry
from touchline.evaluate.cameras.rectangles import RectangleOptions
from touchline.evaluate.cameras.rig_verdict import ComparedPair, RigTrouble, RigVerdict, Source
from touchline.workflows.pair_types import PairReport


class CameraOfRig(TypedDict):
    camera: str
    title: str
    region: str | None
    rotate: int | None
    calibration: str | None
    version: int | None
    model: str | None
    rectangles: RectangleOptions | None
    troubles: list[RigTrouble]


class RigStatus(TypedDict):
    """rectangles: those that all cameras should have; calibration: the active one."""

    rectangles: RectangleOptions | None
    rectangles_from: Literal["rig", "cameras"] | None
    cameras: list[CameraOfRig]


class FailedMatches(ProblemJson):
    part: Literal["all"]


@final
class UselessMatches(TypedDict):
    failed: list[FailedMatches]


_PairSource = TypedDict("_PairSource", {"from": Source | None})


class RigPair(ComparedPair, _PairSource):
    """fundamental: predicted by the calibrations, in ideal pixels; matches: evaluated by themselves."""

    fundamental: PredictedGeometry | None
    matches: PairReport | UselessMatches | None
    notes: list[str]
    failed: ProblemJson | None


class RigCheck(RigStatus):
    pairs: list[RigPair]
    verdict: RigVerdict


class RigReport(RigCheck):
    """missing: cameras that delivered no image."""

    missing: list[RigTrouble]
