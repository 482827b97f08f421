"""What the server and a camera's process send each other: what is watched, how often, and how the process is.

To the process: START with what it is to read, STREAMS {"streams": […]}, CALIBRATE {"calibration", "picture": … | null}
with the picture that it came from, FOLLOW {"part", "settings"} what a part is to do, REQUEST {"what", …}. From it:
START, STATUS, PICTURE (number: of the stream), FEED (number: of the part) what it sends to its other half, ANSWER.

A PICTURE's body is byte for byte what a viewer's WebSocket receives, so that the server hands it on without a look.
"""

from collections import deque
from dataclasses import dataclass
from typing import Literal, Self

from typing_extensions import TypedDict

from touchline.core.drift_status import CameraDrift
from touchline.core.errors import BadInput, ProblemJson
from touchline.core.statements import Stated
from touchline.processes.framing import FIRST_KIND
from touchline.sources import IdentityJson
from touchline.vision.flicker import Flicker
from touchline.vision.light import LightJson
from touchline.vision.sharpness import SharpnessJson
from touchline.vision.zones import Advice, Still

STREAMS, CALIBRATE, FOLLOW, REQUEST, STATUS, PICTURE, FEED = range(FIRST_KIND, FIRST_KIND + 7)


VIEWS = ("raw", "corrected", "side")
# widths are rounded up to its multiples, qualities to tens: viewers who differ little share an
# encoding
STEP_PX = 160
MAX_WIDTH = 3840

# of the interval: a frame so much too early is still taken, or every second would be lost
EARLY_SHARE = 0.25
RATE_FRAMES = 20  # over so many intervals the rate is measured


@dataclass(frozen=True)
class StreamSpec:
    """view: raw, corrected, both side by side, or one that a part of the camera's process draws. width: of the whole
    picture, px; 0 for what the source gives.
    """

    view: str = "raw"
    width: int = 0
    quality: int = 80

    @classmethod
    def requested(cls, view: str = "raw", width: int = 0, quality: int = 80) -> Self:
        """Return the stream that serves such a request; BadInput for a size or quality that none can have."""
        if not (width == 0 or 16 <= width <= MAX_WIDTH):
            raise BadInput(
                f"A width of {width} px cannot be streamed.",
                f"Use 16 to {MAX_WIDTH}, or 0 for the camera's own.",
                reason="bad-width",
            )
        if not 10 <= quality <= 100:
            raise BadInput(
                f"A quality of {quality} cannot be streamed.",
                "Use 10 to 100.",
                reason="bad-quality",
            )
        return cls(
            view,
            -(-width // STEP_PX) * STEP_PX if width > STEP_PX else width and STEP_PX,
            min(95, -(-quality // 10) * 10),
        )

    @property
    def is_of_part(self) -> bool:
        """Whether a part of the camera's process draws it, not the encoder."""
        return self.view not in VIEWS


class Rate:
    """Takes frames no more often than wanted. Moments are of any one clock, s."""

    def __init__(self) -> None:
        self._due_s = 0.0

    def is_due(self, moment_s: float, interval_s: float) -> bool:
        """Return whether a frame of this moment is taken; the next one is due an interval later."""
        if moment_s < self._due_s - EARLY_SHARE * interval_s:
            return False
        self._due_s = max(self._due_s, moment_s - interval_s) + interval_s
        return True


class MeasuredRate:
    """The newest moments, from which the rate follows."""

    def __init__(self) -> None:
        self._moments_s: deque[float] = deque(maxlen=RATE_FRAMES + 1)

    def add(self, moment_s: float) -> None:
        self._moments_s.append(moment_s)

    def clear(self) -> None:
        self._moments_s.clear()

    @property
    def interval_s(self) -> float:
        """The mean time between two; 0 before the second."""
        count = len(self._moments_s) - 1
        return (self._moments_s[-1] - self._moments_s[0]) / count if count > 0 else 0.0


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
