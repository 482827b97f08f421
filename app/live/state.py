"""How a camera is, judged from what its process told last and how long ago that was."""

from dataclasses import dataclass
from typing import Any

from app.core.geometry import ImageSize
from app.sources import Identity

STALL_S = 1.5  # without a frame; a slow camera gets four of its own intervals
KILL_AFTER_S = 0.5  # more, and its process is ended and started anew
OPEN_S = 15.0  # an industrial camera may take some seconds to be found
FROZEN_S = 3.0  # a sensor's noise never stays the same so long
INTERVALS = 4
UNKNOWN_S = 6.0  # a camera of which one picture came may send one every second or two
STATIC_SOURCES = ("picture", "folder", "video", "sim")  # sources whose pictures may stay the same


@dataclass(frozen=True)
class ProcessStatus:
    """What the process said of itself, and when on the server's clock."""

    status: dict[str, Any]
    at: float

    def frame_age_s(self, now: float) -> float | None:
        age = self.status["age_s"]
        return None if age is None else age + (now - self.at)

    @property
    def stall_s(self) -> float:
        interval_s = self.status["interval_s"]
        return max(STALL_S, INTERVALS * interval_s) if interval_s else UNKNOWN_S

    @property
    def size(self) -> ImageSize | None:
        return ImageSize(*self.status["size"]) if self.status["size"] else None

    @property
    def identity(self) -> Identity | None:
        return Identity(**self.status["identity"]) if self.status["identity"] else None


def stall_reason(told: ProcessStatus, now: float, grace_s: float = 0.0) -> str | None:
    """Why it counts as stalled, in words; None while it does not. grace_s: so much longer than usual."""
    # A camera maker's library may hold up the whole process while it looks for its cameras.
    if now - told.at > (STALL_S if told.status["state"] == "live" else UNKNOWN_S) + grace_s:
        return "Its process says nothing any more."
    if told.status["state"] == "live" and told.frame_age_s(now) > told.stall_s + grace_s:
        return f"No picture has come for {told.frame_age_s(now):.1f} s."
    if told.status["state"] == "connecting" and told.status["since_s"] + now - told.at > OPEN_S + grace_s:
        return f"It has not answered for {OPEN_S:g} s."
    return None


def frozen_reason(told: ProcessStatus, scheme: str) -> str | None:
    """Why it shows an old picture again and again, in words."""
    seconds = (told.status.get("inspected") or {}).get("unchanged_s", 0.0)
    if scheme in STATIC_SOURCES or seconds < FROZEN_S:
        return None
    return f"It has sent the very same picture for {seconds:.0f} s."


def calibration_mismatch(told: ProcessStatus, confirmed: Identity | None,
                         image_size: ImageSize | None) -> tuple[str, str, str] | None:
    """(reason, what, fix) where the calibration belongs to another camera, or to another size; None where it fits."""
    if told.size is not None and image_size is not None and told.size != image_size:
        return ("other-size", f"The camera gives {told.size.width} × {told.size.height} px; its calibration was made "
                f"for {image_size.width} × {image_size.height} px.",
                "Set the camera back to that size, or calibrate it at this one.")
    if image_size is not None and confirmed is not None and told.identity is not None:
        why = told.identity.differs_from(confirmed)
        if why:
            return ("other-camera", f"This may be another camera than the one that was calibrated: {why}.",
                    "Look at the picture; confirm it if it is the same camera in the same place, or calibrate anew.")
    return None
