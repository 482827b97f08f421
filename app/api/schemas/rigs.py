"""What a rig looks like at the REST door, asked and answered."""

from typing import Annotated, Any, Literal

from pydantic import Field

from app.api.schemas.requests import CameraId, Height, Name, Number, Pair, Rotate, Strict
from app.api.schemas.responses.base import Answer, Points
from app.workflows.rig import MAX_CAMERAS

MAX_MATCHES = 5000


class RigCamera(Strict):
    """One of the cameras, and the part of the field that it shows first."""

    camera: CameraId
    region: CameraId | None = Field(None, description="left out: the region of its active calibration")
    rotate: Rotate | None = None


class RigBody(Strict):
    """A rig to keep. Either all four of the rectangles or none: then those that most cameras have are the rig's."""

    title: Annotated[str, Field(max_length=100)] = ""
    field: Name
    cameras: Annotated[list[RigCamera | CameraId], Field(min_length=1, max_length=MAX_CAMERAS)]
    w_max_rectangle_px: Number | None = None
    h_max_rectangle_px: Number | None = None
    n_rectangles_x: int | None = None
    n_rectangles_y: int | None = None


class RigMatches(Strict):
    """The same things seen by two of its cameras."""

    a: CameraId
    b: CameraId
    points_a: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    points_b: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    z_mm: Height | Annotated[list[Height | None], Field(max_length=MAX_MATCHES)] = 0.0


class RigCheck(Strict):
    """What to judge by."""

    snapshots: Annotated[dict[CameraId, Name], Field(max_length=MAX_CAMERAS)] = Field(
        {}, description="a kept picture by the camera that took it")
    pictures: Literal["live", "none"] = Field(
        "live", description="live: take one now from each camera without a snapshot; none: go by snapshots alone")
    matches: Annotated[list[RigMatches], Field(max_length=120)] = Field([], description="of some of its pairs")


class RigRefit(Strict):
    """Which of its cameras to refit."""

    cameras: Annotated[list[CameraId], Field(min_length=1, max_length=MAX_CAMERAS)] | None = Field(
        None, description="left out: all whose rectangles are not the rig's")


class Trouble(Answer):
    camera: str
    reason: str
    text: str
    fix: str


class CameraOfRig(Answer):
    camera: str
    title: str
    region: str | None
    rotate: int | None
    calibration: str | None = Field(description="its active one")
    version: int | None
    model: str | None
    rectangles: dict[str, Any] | None
    troubles: list[Trouble]


class Rig(Answer):
    name: str
    title: str
    field: str
    w_max_rectangle_px: float | None
    h_max_rectangle_px: float | None
    n_rectangles_x: int | None
    n_rectangles_y: int | None
    rectangles: dict[str, Any] | None = Field(description="the common ones")
    rectangles_from: Literal["rig", "cameras"] | None
    cameras: list[CameraOfRig]
    updated_at: str
    updated_by: str


class Rigs(Answer):
    items: list[Rig]
    next_cursor: str | None


class Verdict(Answer):
    level: Literal["good", "fair", "poor"] | None
    sentence: str
    fix: str


class RigPair(Answer):
    """from: what the agreement was measured by. fundamental: foretold by the calibrations, in ideal pixels."""

    a: str
    b: str
    agreement: dict[str, Any] | None
    fundamental: dict[str, Any] | None
    matches: dict[str, Any] | None
    verdict: Verdict | None
    notes: list[str]
    failed: dict[str, str] | None


class RigChecked(Answer):
    cameras: list[CameraOfRig]
    rectangles: dict[str, Any] | None
    pairs: list[RigPair]
    verdict: Verdict
    missing: list[Trouble] = Field(description="cameras that gave no picture")


class RigRefitted(Answer):
    calibrations: list[str] = Field(description="new versions, none of them active")


class Stitched(Answer):
    """Where things lie in stitched.jpg of that width."""

    width: int
    height: int
    px_per_mm: float
    overlay: list[dict[str, Any]]
    corner: Points
    unseen: dict[str, Any]
    cameras: list[dict[str, Any]]
