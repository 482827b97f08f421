"""Requests about detection settings, colours, and detections in a snapshot."""

from typing import Annotated, Any

from pydantic import Field

from touchline.services.forms import Coordinate, Name, Strict

Place = Annotated[list[Coordinate], Field(min_length=2, max_length=4)]
Clicks = Annotated[dict[Name, Annotated[list[Place], Field(max_length=40)]], Field(max_length=13)]  # by colour
Spec = Annotated[dict[str, Any], Field(max_length=8)]  # a plan or a profile; read where it is used


class DetectionBody(Strict):
    """A snapshot, the calibration for positions and sizes, and the colours."""

    snapshot: Name
    calibration: Name | None = Field(None, description="of this camera at this size; without it there are no positions")
    stages: Name | Annotated[dict[str, Any], Field(max_length=4)] = Field(
        "ssl", description="a plan by name, or one of your own as GET /stages describes them")
    colours: Spec | None = Field(
        None, description="a profile, as `colours` of an earlier answer")
    clicks: Clicks | None = Field(
        None, description="by colour: [x, y] of a point, or [x0, y0, x1, y1] of a box, raw px")
    mm_per_px: Annotated[float, Field(ge=0.01, le=1000)] | None = Field(
        None, description="size of a px on the carpet, mm, if there is no calibration")
    eye_mm: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = Field(
        None, description="[x, y, height] of the camera, field mm, for a model that is not a physical lens model")

    @property
    def eye(self) -> tuple[float, float, float] | None:
        return None if self.eye_mm is None else (self.eye_mm[0], self.eye_mm[1], self.eye_mm[2])


class DetectionSettingsBody(Strict):
    """The detection settings of a camera: what GET answers, without what it only reports."""

    on: bool
    plan: Name | Spec = Field(description="by name, or complete, as GET /stages describes them")
    colours: Name | None = Field(None, description="a saved profile, including its later changes; or a copy from "
                                                   "another camera")
    profile: Spec | None = Field(None, description="own colours of this camera; they override `colours`")
    publish: bool = Field(False, description="as SSL_DetectionFrame on the league's group")


class ColoursBody(Strict):
    """A profile under the name in the path."""

    profile: Spec


class LearnBody(Strict):
    """Points and boxes by colour in the newest frame or a snapshot; or none."""

    clicks: Clicks = Field(
        {}, description="[x, y] of a point, or [x0, y0, x1, y1] of a box, raw px; `background` for areas without a "
                        "colour")
    base: Name | Spec | None = Field(
        None, description="a profile, by name or complete, whose other colours stay as they are")
    snapshot: Name | None = Field(None, description="by default the newest frame")
    automatic: bool = Field(False, description="detect the colours in the image")
