"""What a request about detections may look like; what plans and profiles mean is the business of the floors below."""

from typing import Annotated, Any

from pydantic import Field

from app.api.schemas.requests import Coordinate, Name, Strict

Place = Annotated[list[Coordinate], Field(min_length=2, max_length=4)]


class DetectionRequest(Strict):
    """A snapshot, what tells places and sizes, and what tells colours."""

    snapshot: Name
    calibration: Name | None = Field(None, description="of this camera at this size; without it there are no places")
    stages: Name | Annotated[dict[str, Any], Field(max_length=4)] = Field(
        "ssl", description="a plan by name, or one of your own as GET /stages tells them")
    colours: Annotated[dict[str, Any], Field(max_length=8)] | None = Field(
        None, description="a profile, as `colours` of an earlier answer")
    clicks: Annotated[dict[Name, Annotated[list[Place], Field(max_length=40)]], Field(max_length=13)] | None = Field(
        None, description="by colour: [x, y] of a click, or [x0, y0, x1, y1] of a box, raw px")
    mm_per_px: Annotated[float, Field(ge=0.01, le=1000)] | None = Field(
        None, description="without a calibration: how large a pixel is")
    eye_mm: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = Field(
        None, description="[x, y, height] of the camera, field mm, for a model without rays")
