"""POST /snapshots/{id}/snap, /along: clicks moved to the middle of the painted line, and points all along a line."""

from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import Field

from app.api.dependencies import ServicesDep
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id
from app.services.snapping import points_along, snap_clicks
from app.services.value_types import Name, Pair, Rotate, Strict
from app.vision.lines.snap import REACH_PX

router = APIRouter(prefix="/snapshots/{id}", tags=["snapshots"])

Reach = Annotated[float, Field(ge=2, le=40, description="how far from the point a line may be, px")]
Feature = Annotated[str, Field(min_length=1, max_length=200, description="border, line or arc of the field")]


class FittedModelForm(Strict):
    """A model as /fit/preview and GET /calibrations/{id} return it."""

    name: Name
    parameters: dict[str, Any]


class FitForm(Strict):
    """Where the field is, as far as it is known."""

    model: FittedModelForm
    field: Name
    region: Name
    rotate: Rotate | None = None


class SnapRequest(Strict):
    """Clicks, and what is known about the line beside them."""

    points: Annotated[list[Pair], Field(max_length=500)]
    reach_px: Reach = REACH_PX
    width_px: Annotated[float, Field(ge=0.5, le=40)] | None = None
    direction_deg: Annotated[float, Field(ge=-360, le=360)] | None = None
    feature: Feature | None = None
    fit: FitForm | None = None


class AlongRequest(Strict):
    """Which line, and how many points are wanted along it."""

    fit: FitForm
    feature: Feature
    count: Annotated[int, Field(ge=1, le=50)] = 9
    reach_px: Reach = REACH_PX


@router.post("/snap", response_model=responses.SnappedPoints)
async def snap_points(services: ServicesDep, id: Id, body: SnapRequest) -> Json:
    """Move each point to the middle of the painted line beside it, or leave it where it is, with the reason.

    width_px and direction_deg say which line is meant; a fit and a feature give both for every point.
    """
    return Json({"points": await services.run_in_thread(snap_clicks, services, id, **dict(body))})


@router.post("/along", response_model=responses.SnappedPoints)
async def find_along(services: ServicesDep, id: Id, body: AlongRequest) -> Json:
    """Find points along one line of the field, beside where a fit expects it; none where it is hidden."""
    return Json({"points": await services.run_in_thread(points_along, services, id, **dict(body))})
