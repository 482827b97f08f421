"""Requests about detection settings, colours, and detections in a snapshot."""

from typing import Annotated, Any

from pydantic import Field

from app.services.forms import Coordinate, Name, Strict

Place = Annotated[list[Coordinate], Field(min_length=2, max_length=4)]
Clicks = Annotated[dict[Name, Annotated[list[Place], Field(max_length=40)]], Field(max_length=13)]  # by colour
Spec = Annotated[dict[str, Any], Field(max_length=8)]  # a plan or a profile; read where it is used


class DetectionBody(Strict):
    """A snapshot, what tells places and sizes, and what tells colours."""

    snapshot: Name
    calibration: Name | None = Field(None, description="of this camera at this size; without it there are no places")
    stages: Name | Annotated[dict[str, Any], Field(max_length=4)] = Field(
        "ssl", description="a plan by name, or one of your own as GET /stages describes them")
    colours: Spec | None = Field(
        None, description="a profile, as `colours` of an earlier answer")
    clicks: Clicks | None = Field(
        None, description="by colour: [x, y] of a click, or [x0, y0, x1, y1] of a box, raw px")
    mm_per_px: Annotated[float, Field(ge=0.01, le=1000)] | None = Field(
        None, description="without a calibration: how large a pixel is")
    eye_mm: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = Field(
        None, description="[x, y, height] of the camera, field mm, for a model without rays")


class DetectionSettingsBody(Strict):
    """The detection settings of a camera: what GET answers, without what it only reports."""

    on: bool
    plan: Name | Spec = Field(description="by name, or complete, as GET /stages describes them")
    colours: Name | None = Field(None, description="a kept profile, which is followed; as copied from another camera")
    profile: Spec | None = Field(None, description="colours of this camera's own; they win over `colours`")
    publish: bool = Field(False, description="as SSL_DetectionFrame on the league's group")


class ColoursBody(Strict):
    """A profile under the name in the path."""

    profile: Spec


class LearnBody(Strict):
    """Clicks and boxes by colour in the newest frame or a snapshot; or no click at all."""

    clicks: Clicks = Field(
        {}, description="[x, y] of a click, or [x0, y0, x1, y1] of a box, raw px; `background` for what is no colour")
    base: Name | Spec | None = Field(None, description="a profile, by name or whole, that keeps its other colours")
    snapshot: Name | None = Field(None, description="the newest frame when left out")
    automatic: bool = Field(False, description="find the colours in the picture")
