"""/referee: the game controller, the teams that play, and the table of robot heights."""

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api.bodies import uploaded_file
from touchline.api.dependencies import IfMatch, ServicesDep, in_thread
from touchline.api.responses import Json, attachment, versioned
from touchline.api.schemas import JsonObject, Texts, files, list_of, response, upload
from touchline.referee.heights import MAX_TEAMS, write_heights
from touchline.referee.service import RefereeConfig, RefereeService
from touchline.services.forms import Number, Strict

router = APIRouter(prefix="/referee", tags=["publishing"])
MAX_FILE_BYTES = 1 << 18
TEXT = "text/plain"

Text = Annotated[str, Field(max_length=64)]
TableHeight = response("TableHeight", team=str, height_mm=float, own=bool)
Referee = response(
    "Referee",
    record=RefereeConfig,
    listening=bool,
    problem=Texts | None,
    teams=JsonObject,
    table=list_of(TableHeight),
    controllers=list[JsonObject],
    interfaces=list[JsonObject],
)


class TeamChanges(Strict):
    """What is known of a team without a game controller."""

    name: Text | None = Field(default=None, description="as in the table")
    height_mm: Number | None = Field(
        default=None, description="of its robots, mm; wins over the table"
    )


class RefereeChanges(Strict):
    """The settings to change; omitted values stay."""

    enabled: bool | None = Field(
        None, description="null: while geometry is published or listened to"
    )
    group: Text = Field("", description="IPv4 multicast address")
    port: Annotated[int, Field(ge=1, le=65535)] = 10003
    interface: Text = Field("", description="name or address; empty: that of publishing")
    blue: TeamChanges = Field(
        default_factory=TeamChanges, description="by hand; {}: by the game controller"
    )
    yellow: TeamChanges = Field(
        default_factory=TeamChanges, description="by hand; {}: by the game controller"
    )
    heights: Annotated[dict[Text, Number | None], Field(max_length=MAX_TEAMS)] = Field(
        {},
        description="own entries of the table, mm; null removes one; other entries are unchanged",
    )


@router.get("", response_model=Referee)
@in_thread
def read_referee(services: ServicesDep) -> Json:
    """Return the game controllers that are heard, the teams with the heights of their robots, and the table.

    The ETag of the settings goes into the next PUT's If-Match.
    """
    referee = services.part(RefereeService)
    etag = referee.etag  # an older one than the settings only makes a change too careful
    return versioned(referee.status(), etag)


@router.put("", response_model=Referee)
async def update_referee(
    services: ServicesDep, body: RefereeChanges, if_match: IfMatch = None
) -> Json:
    """Change some settings, also for after a restart; omitted values stay. The cameras follow at once.

    With If-Match only if nobody has changed them since: else 412, with `current`.
    """
    changes = body.model_dump(exclude_unset=True)
    await services.run_in_thread(services.part(RefereeService).change, changes, if_match)
    return await read_referee(services)


@router.get("/robot-heights.yml", response_class=Response, responses=files(TEXT))
@in_thread
def export_robot_heights(services: ServicesDep) -> Response:
    """Return the table as vision-processor's robot-heights.yml."""
    return Response(
        write_heights(services.part(RefereeService).table),
        media_type=TEXT,
        headers={"Content-Disposition": attachment("robot-heights.yml")},
    )


@router.post("/robot-heights", response_model=Referee, openapi_extra={"requestBody": upload()})
async def import_robot_heights(
    request: Request, services: ServicesDep, if_match: IfMatch = None
) -> Json:
    """Read a robot-heights.yml, multipart with `file`: what it has beside the table becomes own entries."""
    data, _ = await uploaded_file(request, MAX_FILE_BYTES, ())
    await services.run_in_thread(services.part(RefereeService).add_file, data, if_match)
    return await read_referee(services)
