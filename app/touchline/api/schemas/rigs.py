"""Requests about rigs."""

from typing import Annotated, Literal

from pydantic import Field

from touchline.api.schemas.requests import CameraId
from touchline.services.forms import HeightForm, Name, Number, Pair, Rotate, Strict
from touchline.workflows.rig import MAX_CAMERAS

MAX_MATCHES = 5000


class RigCamera(Strict):
    """One of the cameras, and the part of the field that it shows first."""

    camera: CameraId
    region: CameraId | None = Field(None, description="by default the region of its active calibration")
    rotate: Rotate | None = None


class RigBody(Strict):
    """A rig to save. Either all four of the rectangles or none: then those that most cameras have are the rig's."""

    title: Annotated[str, Field(max_length=100)] = ""
    field: Name
    cameras: Annotated[list[RigCamera | CameraId], Field(min_length=1, max_length=MAX_CAMERAS)]
    w_max_rectangle_px: Number | None = None
    h_max_rectangle_px: Number | None = None
    n_rectangles_x: int | None = None
    n_rectangles_y: int | None = None


class RigMatches(Strict):
    """The same points in two of its cameras."""

    a: CameraId
    b: CameraId
    points_a: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    points_b: Annotated[list[Pair | None], Field(min_length=1, max_length=MAX_MATCHES)]
    z_mm: HeightForm | Annotated[list[HeightForm | None], Field(max_length=MAX_MATCHES)] = 0.0


class RigCheck(Strict):
    """What a rig is checked by."""

    snapshots: Annotated[dict[CameraId, Name], Field(max_length=MAX_CAMERAS)] = Field(
        {}, description="a saved image by the camera that took it")
    pictures: Literal["live", "none"] = Field(
        "live", description="live: take one now from each camera without a snapshot; none: go by snapshots alone")
    matches: Annotated[list[RigMatches], Field(max_length=120)] = Field([], description="of some of its pairs")


class RigRefit(Strict):
    """Which of its cameras to refit."""

    cameras: Annotated[list[CameraId], Field(min_length=1, max_length=MAX_CAMERAS)] | None = Field(
        None, description="by default all whose rectangles differ from those of the rig")
