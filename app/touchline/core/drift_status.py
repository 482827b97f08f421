"""Whether a camera still stands as it did when it was calibrated: the status that all read who trust a camera."""

from typing import Literal

from touchline.core.statements import Stated

DriftState = Literal[
    "learning",
    "unfollowed",
    "steady",
    "misplaced",
    "knocked",
    "out-of-focus",
    "replaced",
    "covered",
    "dark",
]


class DriftJson(Stated):
    """Whether a camera stands as it did; px and mm are not exceeded by 95 % of its region. since: unix, s.

    monitored: whether a movement would be seen now; an alarm stays while it would not. doubt: what makes the
    calibration itself only fair, though the camera stays; empty for nothing.
    """

    state: DriftState
    alarm: bool
    monitored: bool
    since: float
    px: float | None
    mm: float | None
    sigma_px: float | None
    sigma_mm: float | None
    softer_px: float | None
    seen: int
    sentence: str
    fix: str
    doubt: str


class CameraDrift(DriftJson):
    """reference: the picture that is compared with, of the calibration or from the start of following."""

    calibration: str
    reference: Literal["calibration", "start"] | None
    took_ms: float
