"""/straightness: how far straight edges bend in images, and an image without that."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api.dependencies import ServicesDep, in_thread
from touchline.api.request_mapping import image_size, pictures_of_one_size
from touchline.api.responses import finished_or_queued, picture
from touchline.api.schemas import responses
from touchline.api.schemas.base import JsonObject, response
from touchline.api.schemas.media import PICTURE
from touchline.api.schemas.requests import AsJob, Format, WidthPx
from touchline.core.geometry import MAX_COORDINATE
from touchline.models.distortion import Distortion
from touchline.services.container import Services
from touchline.services.forms import (
    Coordinate,
    Name,
    Number,
    OptionText,
    Pair,
    Size,
    Strict,
)
from touchline.workflows.straight_lines import undistort
from touchline.workflows.straight_lines_request import StraightLinesRequest, run_straightness

router = APIRouter(prefix="/straightness", tags=["lenses"])

Straightness = response("Straightness", says=True, lens=JsonObject, sigma=dict[str, float],
    straightness_px=dict[str, float], bow=JsonObject, distortion=Literal["significant", "none", "unknown"],
    sentence=str, lines=list[JsonObject], lines_used=int, objects=int, pictures=list[str], cannot_see=str)


class StraightnessRequest(Strict):
    """Images of one camera, lines marked in the first of them (or in none), or both."""

    snapshots: Annotated[list[Name], Field(max_length=50)] = Field([])
    lines: Annotated[list[Annotated[list[Pair], Field(max_length=20_000)]], Field(max_length=2000)] = Field(
        [], description="[[x, y], …] px along one straight edge each")
    image_size: Size | None = Field(None, description="of the image, required if there are only lines")
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        None, description="uncertainty of the lens centre around the image centre, px; 0: fixed; by default 1 % of "
                          "the diagonal")


class PlumbLensForm(Strict):
    """A lens as `lens` of a response on straightness."""

    name: Name
    terms: Annotated[dict[OptionText, Coordinate], Field(max_length=10)]
    centre_px: Pair
    image_size: Size
    unit: Literal["half-diagonal"] = "half-diagonal"
    unit_px: Number | None = None


class StraightenedRequest(Strict):
    """An image, and the lens whose distortion is removed."""

    snapshot: Name
    lens: PlumbLensForm


@router.post("", response_model=Straightness, responses=responses.ACCEPTED)
async def measure_straightness(request: Request, services: ServicesDep, body: StraightnessRequest,
                               job: AsJob = False) -> Response:
    """Measure edges of images, or lines marked in one: how far the lens bends them, and what correction leaves.

    Needs no field and no board, and gives no focal length. With ?job=true a job, whose result is the same.
    """
    spec = await services.run_in_thread(_spec, services, body)
    return await finished_or_queued(request, services, "straightness", run_straightness, spec, job)


@router.post("/picture.{format}", response_class=Response, responses=PICTURE)
@in_thread
def straighten_image(services: ServicesDep, format: Format, body: StraightenedRequest,
                     width: WidthPx = None) -> Response:
    """Return a snapshot without distortion, by the `lens` of a response; `straight` of its lines is in its px."""
    lens = Distortion.from_json(body.lens.model_dump())
    return picture(undistort(services.frame(body.snapshot).pixels, lens, width), format)


def _spec(services: Services, body: StraightnessRequest) -> dict[str, Any]:
    """Refuse at once what can be, and return what the job takes."""
    size = image_size(body.image_size)
    task = StraightLinesRequest(body.lens, body.centre_sigma_px, tuple(body.lines), size)
    task.check_given(len(body.snapshots))
    pictures = pictures_of_one_size(services, body.snapshots, size, "Use images of one camera at one resolution.")
    return {"task": task.to_json(), "pictures": pictures}
