"""How a camera is, judged by the last status of its process and how long ago that came."""

from dataclasses import dataclass
from typing import Any, Self

from touchline.core.drift_status import CameraDrift
from touchline.core.errors import ProblemJson
from touchline.core.geometry import ImageSize
from touchline.core.sentences import SET_RESOLUTION
from touchline.core.statements import Sentence, say, stated
from touchline.live.status_types import ProcessValues
from touchline.sources import Identity
from touchline.vision.quality.stillness import LONG_S, Still

STALL_S = 1.5  # without a frame; a slow camera gets four of its own intervals
KILL_AFTER_S = 0.5  # more, and its process is ended and started anew
OPEN_S = 15.0  # an industrial camera may take some seconds to be found
FROZEN_S = 3.0  # a sensor's noise never stays the same so long, where each picture comes whole
INTERVALS = 4
UNKNOWN_S = 6.0  # a camera of which one picture came may send one every second or two
STATIC_SOURCES = ("picture", "folder", "video", "sim")  # sources whose pictures may stay the same
CODED_SOURCES = ("rtsp",)  # sources whose pictures may stay the same up to the next key frame:
FROZEN_CODED_S = 60.0
SHARE_IN_DOUBT = 0.2  # of a picture: coded anew from a frozen one, a quarter to all of it stays the same
NO_NOISE_FIX = say("camera.no-noise.fix", "If the camera still delivers new images, set it to less compression and to "
                   "key frames every few seconds; otherwise restart it.")


@dataclass(frozen=True)
class ProcessStatus:
    """The last status that a camera's process sent, and when it came on the server's clock."""

    values: ProcessValues
    received_s: float

    @classmethod
    def initial(cls, now: float) -> Self:
        """Return the status of a process that has sent none yet."""
        return cls({"state": "connecting", "problem": None, "since_s": 0.0, "seq": 0, "interval_s": 0.0,
                    "identity": None, "reopened": 0, "age_s": None, "size": None, "encoded": 0, "quality": None,
                    "drift": None, "failures": {"count": 0, "newest": None}}, now)

    def updated(self, values: Any, now: float) -> "ProcessStatus":
        """Return what it is by the newest report, as JSON."""
        return ProcessStatus({**self.values, **values}, now)

    def frame_age_s(self, now: float) -> float | None:
        age_s = self.values["age_s"]
        return None if age_s is None else age_s + (now - self.received_s)

    @property
    def stall_s(self) -> float:
        interval_s = self.values["interval_s"]
        return max(STALL_S, INTERVALS * interval_s) if interval_s else UNKNOWN_S

    @property
    def size(self) -> ImageSize | None:
        return ImageSize(*self.values["size"]) if self.values["size"] else None

    @property
    def identity(self) -> Identity | None:
        return Identity(**self.values["identity"]) if self.values["identity"] else None


def stall_reason(status: ProcessStatus, now: float, grace_s: float = 0.0) -> Sentence | None:
    """Say why it counts as stalled; None while it does not. grace_s: so much longer than usual."""
    state, silent_s, age_s = status.values["state"], now - status.received_s, status.frame_age_s(now)
    # A camera maker's library may hold up the whole process while it looks for its cameras.
    if silent_s > (STALL_S if state == "live" else UNKNOWN_S) + grace_s:
        return say("camera.process-silent", "The camera process is not responding.")
    if state == "live" and age_s is not None and age_s > status.stall_s + grace_s:
        return say("camera.no-frame", "No frame received for {seconds:.1f} s.", seconds=age_s)
    if state == "connecting" and status.values["since_s"] + silent_s > OPEN_S + grace_s:
        return say("camera.no-response", "The camera has not responded for {seconds:g} s.", seconds=OPEN_S)
    return None


def frozen_reason(status: ProcessStatus, scheme: str) -> Sentence | None:
    """Say why it counts as showing an old picture again and again; None where it does not."""
    still = _still(status, scheme)
    if still is None:
        return None
    if still["all_s"] >= (FROZEN_CODED_S if scheme in CODED_SOURCES else FROZEN_S):
        return say("camera.picture-frozen", "The picture has not changed for {seconds:.0f} s.", seconds=still["all_s"])
    if scheme not in CODED_SOURCES and still["had_noise"] and (still["most_s"] or 0.0) >= LONG_S:
        return say("camera.picture-frozen-but", "The picture has not changed for {seconds:.0f} s, except in a small "
                   "part.", seconds=still["most_s"])
    return None


def frozen_doubt(status: ProcessStatus, scheme: str) -> Sentence | None:
    """Say why nobody can know whether its picture is frozen; None where it is seen to change."""
    still = _still(status, scheme)
    if still is None or still["share"] < SHARE_IN_DOUBT:
        return None
    return say("camera.no-noise", "{share:.0f} % of the picture has not changed for {seconds:.0f} s: a frozen picture "
               "looks the same. Movement of the camera cannot be detected.", share=100 * still["share"], seconds=LONG_S)


def unmonitored(drift: CameraDrift, why: Sentence) -> CameraDrift:
    """Return what is known of a camera's drift where nobody can know whether its picture is frozen; alarms stay."""
    if drift["alarm"]:
        return {**drift, "monitored": False}
    return stated(CameraDrift(**{**drift, "state": "unfollowed", "monitored": False, "px": None, "mm": None,
                                 "sigma_px": None, "sigma_mm": None, "sentence": why, "fix": NO_NOISE_FIX}))


def _still(status: ProcessStatus, scheme: str) -> Still | None:
    quality = status.values["quality"]
    return None if quality is None or scheme in STATIC_SOURCES else quality["still"]


def calibration_mismatch(status: ProcessStatus, confirmed: Identity | None,
                         image_size: ImageSize | None) -> ProblemJson | None:
    """Return the problem where the calibration belongs to another camera or another size; None where it fits."""
    size, identity = status.size, status.identity
    if size is not None and image_size is not None and size != image_size:
        return camera_problem("other-size", say(
            "camera.other-size", "The camera sends {size}; its calibration is for {wanted}.", size=size,
            wanted=image_size), SET_RESOLUTION)
    if image_size is None or confirmed is None or identity is None:
        return None
    difference = identity.differs_from(confirmed)
    return None if difference is None else camera_problem(
        "other-camera",
        say("camera.other-camera", "This may not be the camera that was calibrated: {difference}.",
            difference=difference),
        say("camera.confirm-or-calibrate", "Check the picture. Confirm it if it is the same camera in the same "
            "position, or calibrate it again."))


def camera_problem(reason: str, what: str, fix: str) -> ProblemJson:
    return stated(ProblemJson(reason=reason, what=what, fix=fix))
