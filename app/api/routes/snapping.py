"""POST /snapshots/{id}/snap, /along: clicks drawn to the middle of the painted line, and points all along a line."""

import math
from typing import Annotated, Any

from fastapi import APIRouter, Request
from pydantic import Field as Member

from app.api.answers import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id, Name, Pair, Rotate, Strict
from app.api.work import at_work
from app.core.errors import Conflict
from app.core.field import Field, Region
from app.core.geometry import as_points
from app.core.records import Frame
from app.evaluate.fit.click_guides import line_hints, snap_along
from app.models import CameraModel, model_from_json
from app.vision.lines.snap import REACH_PX, REASONS, Hint, Snapped, Unsnapped, snap

router = APIRouter(prefix="/snapshots/{id}", tags=["snapshots"])

Reach = Annotated[float, Member(ge=2, le=40, description="how far from the point a line may be, px")]
Feature = Annotated[str, Member(min_length=1, max_length=200, description="border, line or arc of the field")]


class GivenModel(Strict):
    """A model as /fit/preview and GET /calibrations/{id} tell it."""

    name: Name
    parameters: dict[str, Any]


class GivenFit(Strict):
    """Where the field is, as far as it is known."""

    model: GivenModel
    field: Name
    region: Name
    rotate: Rotate | None = None


class SnapRequest(Strict):
    """Clicks, and what is known about the line beside them."""

    points: Annotated[list[Pair], Member(max_length=500)]
    reach_px: Reach = REACH_PX
    width_px: Annotated[float, Member(ge=0.5, le=40)] | None = None
    direction_deg: Annotated[float, Member(ge=-360, le=360)] | None = None
    feature: Feature | None = None
    fit: GivenFit | None = None


class AlongRequest(Strict):
    """Which line, and how many points are wanted along it."""

    fit: GivenFit
    feature: Feature
    count: Annotated[int, Member(ge=1, le=50)] = 9
    reach_px: Reach = REACH_PX


@router.post("/snap", response_model=responses.SnappedPoints)
async def snap_points(request: Request, id: Id, body: SnapRequest) -> Json:
    """Each point moved to the middle of the painted line beside it, or kept where it is, with the reason.

    width_px and direction_deg tell which line is meant; a fit and a feature tell both for every point.
    """
    return Json({"points": await at_work(request, _snapped, request, id, body)})


def _snapped(request: Request, id: str, body: SnapRequest) -> list[dict[str, Any]]:
    frame: Frame = request.app.state.frames[id]
    points = as_points(body.points, "The points").reshape(-1, 2)
    angle = None if body.direction_deg is None else math.radians(body.direction_deg)
    told = [Hint(body.reach_px, body.width_px, angle)] * len(points)
    if body.fit is not None and body.feature is not None:
        model, field, region = _fit(request, body.fit, frame)
        told = line_hints(model, field.feature(body.feature, region), field, region, points, body.reach_px)
    return [_told(point, _beside(frame, point, hint)) for point, hint in zip(points.tolist(), told, strict=True)]


def _beside(frame: Frame, point: list[float], hint: Hint) -> Snapped | Unsnapped:
    """With what is known of the line; a poor fit that knows wrongly must not hide a line that is there."""
    found = snap(frame.pixels, point, hint)
    blank = Hint(hint.reach_px)
    return snap(frame.pixels, point, blank) if isinstance(found, Unsnapped) and hint != blank else found


@router.post("/along", response_model=responses.SnappedPoints)
async def find_along(request: Request, id: Id, body: AlongRequest) -> Json:
    """Points along one line of the field, found beside where a fit expects it; none where it is hidden."""
    return Json({"points": await at_work(request, _along, request, id, body)})


def _along(request: Request, id: str, body: AlongRequest) -> list[dict[str, Any]]:
    frame: Frame = request.app.state.frames[id]
    model, field, region = _fit(request, body.fit, frame)
    found = snap_along(frame.pixels, model, body.feature, field, region, body.count, body.reach_px)
    return [_told(list(one.point), one) for one in found]


def _fit(request: Request, given: GivenFit, frame: Frame) -> tuple[CameraModel, Field, Region]:
    model = model_from_json(given.model.name, given.model.parameters)
    if model.image_size != frame.size:
        raise Conflict(f"The fit is for {model.image_size.width} × {model.image_size.height} px, the picture has "
                       f"{frame.size.width} × {frame.size.height}.", "Fit this picture first.", reason="size-mismatch")
    field = request.app.state.fields[given.field]
    return model, field, field.region(given.region, given.rotate)


def _told(asked: list[float], answer: Snapped | Unsnapped) -> dict[str, Any]:
    if isinstance(answer, Unsnapped):
        return {"state": "kept", "point": asked, "reason": answer.reason, "what": REASONS[answer.reason]}
    return {"state": "snapped", "point": list(answer.point), "moved_px": answer.moved_px, "width_px": answer.width_px,
            "direction_deg": math.degrees(answer.angle_rad), "sigma_px": answer.sigma_px,
            "confidence": answer.confidence}
