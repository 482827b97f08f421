"""What requests look like: parameters in paths and queries, and bodies."""

from typing import Annotated, Any, Literal

from fastapi import Path, Query
from pydantic import BaseModel, ConfigDict, Field

from touchline.core.errors import BadInput
from touchline.services.forms import (
    Name,
    Note,
    Number,
    ObservationForm,
    OptionText,
    OptionValues,
    Pair,
    Rotate,
    Size,
    Strict,
)

MAX_TRANSFORM_POINTS = 100_000
MAX_PICTURES = 25  # of one camera; a background is made of no more

FrameName = Literal["image", "corrected", "field"]
Format = Literal["png", "jpg"]

# Ids and names in a path: short, and never a path of their own.
Id = Annotated[str, Path(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
IdQuery = Annotated[str, Query(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
MarginPx = Annotated[int, Query(ge=0, le=2000, description="carpet shown around the region, px")]
WidthPx = Annotated[
    int | None,
    Query(ge=16, le=8192, description="width of the image, px; by default the natural width"),
]
Limit = Annotated[int, Query(ge=1, le=200)]
AsJob = Annotated[
    bool, Query(description="answer 202 with a job immediately and run it in the background")
]
Cursor = Annotated[str | None, Query(max_length=200)]


class BorderRequest(Strict):
    """One border's points."""

    points: Annotated[list[Pair], Field(max_length=2000)]
    axis: Literal["x_of_y", "y_of_x"]
    degree: Annotated[int, Field(ge=1, le=8)] | Literal["auto"] = "auto"
    image_size: Size | None = None


class FitRequest(Strict):
    """Everything that a calibration is made from."""

    camera: Name | None = None
    snapshot: Name | None = None
    image_size: Size | None = None
    field: Name
    region: Name
    rotate: Rotate | None = None
    model: Annotated[
        Name,
        Field(
            description='of GET /models; or "auto", the one that a comparison of all recommends, '
            "whose reasons are in the report's model_choice"
        ),
    ] = "polynomial"
    options: OptionValues = Field({})
    observations: Annotated[list[ObservationForm], Field(max_length=500)]
    note: Note = ""


class SaveRequest(FitRequest):
    """The same, to be saved as a new version."""

    compare: bool = Field(
        True,
        description='for the model "auto": compare all models before it is saved; false saves the most probable lens '
        "at once, as a preview shows it",
    )


class CompareRequest(FitRequest):
    """The same, for several models; `model` is ignored."""

    models: Annotated[list[Name], Field(min_length=1, max_length=20)] | None = None


# as the settings take names
CameraId = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")]
Address = Annotated[str, Field(min_length=1, max_length=2000)]


class NewCamera(Strict):
    """A camera to add."""

    id: CameraId
    name: Annotated[str, Field(max_length=100)] = ""
    source: Address = Field(description="where frames come from, such as rtsp://10.0.0.5/live")
    field: CameraId | None = None
    region: CameraId | None = None


class CameraChanges(Strict):
    """The values to change; omitted values stay."""

    name: Annotated[str, Field(max_length=100)] = ""
    source: Address | None = None
    field: CameraId | None = None
    region: CameraId | None = None


class CameraTestRequest(Strict):
    """A source to be tried out."""

    source: Address


class RestoreBackup(Strict):
    """The numbers of backup and database whose exchange somebody has agreed to; without both, nothing is exchanged."""

    backup: int | None = None
    database: int | None = None


class ControlChanges(Strict):
    """New values by the control's name; "auto" hands it to the camera."""

    controls: Annotated[
        dict[OptionText, bool | int | Number | OptionText], Field(min_length=1, max_length=20)
    ]


class DraftBody(Strict):
    """An operator's work in progress on one snapshot."""

    field: Name | None = None
    region: Name | None = None
    rotate: Rotate | None = None
    model: Name | None = None
    options: OptionValues = Field({})
    observations: Annotated[list[ObservationForm], Field(max_length=500)] = Field([])


class TransformRequest(Strict):
    """Points from one frame to another."""

    source: FrameName = Field(alias="from")
    target: FrameName = Field(alias="to")
    points: Annotated[list[Pair], Field(max_length=MAX_TRANSFORM_POINTS)]
    z_mm: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
    image_size: Size | None = Field(
        None, description="size of the image of the points, compared with the calibration"
    )


class PictureChoice(Strict):
    """The selected images: one of snapshot, snapshots and camera."""

    snapshot: Name | None = None
    snapshots: Annotated[list[Name], Field(min_length=1, max_length=MAX_PICTURES)] | None = Field(
        None, description="several of one camera: moving objects are removed"
    )
    camera: Name | None = Field(None, description="take images now; moving objects are removed")

    @property
    def ids(self) -> list[str]:
        return self.snapshots or ([self.snapshot] if self.snapshot else [])

    def check_choice(self, required: bool) -> None:
        """Refuse more than one, or none where one is required."""
        count = sum(given is not None for given in (self.snapshot, self.snapshots, self.camera))
        if count > 1 or (required and count == 0):
            raise BadInput(
                "The request does not select an image.",
                "Send exactly one of snapshot, snapshots and camera.",
                reason="bad-request",
            )


Purpose = Literal["picture", "board", "straight", "rig", "seeing"]


class CameraSnapshot(Strict):
    """Take an image from a camera: one frame, or several frames with moving objects removed."""

    camera: Name
    frames: Annotated[int, Field(ge=1, le=60)] = Field(
        1, description="more than 1: moving people and robots are removed, and noise is reduced"
    )
    over_s: Annotated[float, Field(ge=0, le=60)] | None = Field(
        None,
        description="time between the first and the last, s; by default a third of a second for each",
    )
    purpose: Purpose = Field(
        "picture",
        description="purpose: a field, a board, straight edges, the check of a rig, or colours",
    )


class Problem(BaseModel):
    """What was wrong, and what to do about it (RFC 9457 with `fix`)."""

    model_config = ConfigDict(extra="allow")

    type: str
    title: str
    status: int
    detail: str
    fix: str


# "default" describes every refusal: any call may be refused for its token, its size or its path.
PROBLEMS: dict[int | str, dict[str, Any]] = {
    "default": {
        "description": "Problem and remedy",
        "content": {
            "application/problem+json": {
                "schema": {"$ref": f"#/components/schemas/{Problem.__name__}"}
            }
        },
    }
}
