"""What requests about live seeing and colours may look like."""

from typing import Annotated, Any

from pydantic import Field

from app.api.schemas.detections import Place
from app.api.schemas.requests import Name, Strict
from app.api.schemas.responses.base import Answer

Whole = Annotated[dict[str, Any], Field(max_length=8)]


class SeeingBody(Strict):
    """All that is set for a camera; GET's answer without what is only told."""

    on: bool
    plan: Name | Whole = Field(description="by name, or whole as GET /stages tells them")
    colours: Name | None = Field(None, description="a kept profile, which is followed; as copied from another camera")
    profile: Whole | None = Field(None, description="colours of this camera's own; they win over `colours`")
    publish: bool = Field(False, description="as SSL_DetectionFrame on the league's group")


class ColoursBody(Strict):
    """A profile under the name in the path."""

    profile: Whole


class LearnRequest(Strict):
    """Clicks and boxes by colour in the newest frame or a snapshot; or no click at all."""

    clicks: Annotated[dict[Name, Annotated[list[Place], Field(max_length=40)]], Field(max_length=13)] = Field(
        {}, description="[x, y] of a click, or [x0, y0, x1, y1] of a box, raw px; `background` for what is no colour")
    base: Name | Whole | None = Field(None, description="a profile, by name or whole, that keeps its other colours")
    snapshot: Name | None = Field(None, description="the newest frame when left out")
    automatic: bool = Field(False, description="find the colours in the picture")


class SeeingTold(Answer):
    """What a camera is to see. learned: whether its colours were clicked or found in its picture, null before that."""

    on: bool
    plan: dict[str, Any]
    colours: str | None
    profile: dict[str, Any] | None
    learned: str | None
    health: list[dict[str, Any]]
    publish: bool
    published: dict[str, Any]


class ColoursTold(Answer):
    name: str
    profile: dict[str, Any]
    health: list[dict[str, Any]]
    used_by: list[str]


class ColoursList(Answer):
    items: list[ColoursTold]
    next_cursor: str | None


class Learned(Answer):
    profile: dict[str, Any]
    health: list[dict[str, Any]]
    notes: list[str]


class Seen(Answer):
    """One frame. items: what was found; ms: of all stages, of processor time; fps: frames that are looked at."""

    seq: int
    time_s: float
    items: list[dict[str, Any]]
    stages: list[dict[str, Any]]
    ms: float
    notes: list[str]
    fps: float
