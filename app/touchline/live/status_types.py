"""What a camera's process tells of itself, and what the server makes of it, as JSON."""

from typing import Literal

from typing_extensions import TypedDict

from touchline.core.drift_status import CameraDrift
from touchline.core.errors import ProblemJson
from touchline.core.statements import Stated
from touchline.sources import IdentityJson
from touchline.vision.quality.flicker import Flicker
from touchline.vision.quality.light import LightJson
from touchline.vision.quality.sharpness import SharpnessJson
from touchline.vision.quality.stillness import Still
from touchline.vision.quality.zones import Advice

SourceState = Literal["connecting", "live", "offline"]
CameraState = Literal["idle", "connecting", "live", "stalled", "offline", "mismatch"]


class CaptureStatus(TypedDict, total=False):
    """Of the source. Ages in s, on the clock of the camera's process."""

    state: SourceState
    problem: ProblemJson | None
    since_s: float
    seq: int
    interval_s: float
    identity: IdentityJson | None
    reopened: int
    age_s: float | None
    size: list[int] | None


class PictureQuality(TypedDict):
    """still: for how long it has stayed the same. print: the newest picture, as PicturePrint.to_text() gives it."""

    still: Still | None
    print: str | None
    light: LightJson | None
    sharpness: SharpnessJson | None
    flicker: Flicker | None
    words: list[Advice]


class Failure(Stated):
    what: str
    error: str
    is_recent: bool


class FailuresJson(TypedDict):
    count: int
    newest: Failure | None


class ProcessValues(CaptureStatus, total=False):
    """All that a camera's process reports, without what is of interest to one capability alone; some
    entries are absent before its first report."""

    encoded: int
    quality: PictureQuality | None
    drift: CameraDrift | None
    failures: FailuresJson


class CameraStatus(TypedDict):
    """State of a camera, what is wrong and what to do. words: on light and focus, what is wrong first.

    seq, reopened, encoded: counted by its process, null before one has started.
    """

    state: CameraState
    problem: ProblemJson | None
    fps: float
    width: int | None
    height: int | None
    frame_age_s: float | None
    reconnects: int
    viewers: int
    calibration_applied: bool
    active_calibration: str | None
    light: LightJson | None
    sharpness: SharpnessJson | None
    flicker: Flicker | None
    words: list[Advice]
    drift: CameraDrift | None
    drift_px: float | None
    seq: int | None
    identity: IdentityJson | None
    reopened: int | None
    encoded: int | None


class ListedCameraStatus(CameraStatus):
    id: str
