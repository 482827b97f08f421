"""/pairs: two cameras that see the same: fundamental matrix, epipolar lines, agreement."""

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import Field
from starlette.responses import Response

from touchline.api.dependencies import ServicesDep, in_thread
from touchline.api.responses import Json, finished_or_queued
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.services.forms import HeightForm, Name, Number, Pair, Size, Strict
from touchline.workflows.pair import lines_by_calibrations, lines_by_matrix, run_pair
from touchline.workflows.pair_types import PairLines, PairReport

router = APIRouter(prefix="/pairs", tags=["judging"])


class PairRequest(Strict):
    """The same points in two images, two calibrations over one field, or both."""

    points_a: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in image a; null for a point that is not marked yet and only counts")
    points_b: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in image b; null: not marked yet")
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | Annotated[list[HeightForm | None], Field(max_length=20_000)] = Field(
        0.0, description="height of the matched points, mm: of all, or of each, null where it is unknown")


class PairLinesRequest(Strict):
    """Points in the images of a pair, for their epipolar lines: by a matrix, or by two calibrations."""

    points_a: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in image a")
    points_b: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in image b")
    matrix: Annotated[list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
                      Field(min_length=3, max_length=3)] | None = Field(
                          None, description="the fundamental matrix, 3 × 3, as POST /pairs has it")
    image_size_a: Size | None = Field(None, description="[width, height] px, with a matrix")
    image_size_b: Size | None = None
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | None = Field(0.0, description="height of the points, mm; null where it is unknown")


@router.post("", response_model=PairReport)
async def compare_pair(request: Request, services: ServicesDep, body: PairRequest) -> Response:
    """Return the fundamental matrix of matched points, the pose between two lenses, and the cameras' agreement in mm.

    Each is null where it was not requested; one that cannot be computed is named in `failed`, with what to do.
    """
    a, b = (None if id is None else services.store.calibrations.get(id).to_json()
            for id in (body.calibration_a, body.calibration_b))
    spec = {"points_a": body.points_a, "points_b": body.points_b, "calibration_a": a, "calibration_b": b,
            "z_mm": body.z_mm}
    return await finished_or_queued(request, services, "pair", run_pair, spec, as_job=False)


@router.post("/lines", response_model=PairLines)
@in_thread
def find_epipolar_lines(services: ServicesDep, body: PairLinesRequest) -> Json:
    """Return epipolar lines of points, each in the other image, and the same position there at `z_mm`.

    By a fundamental `matrix` they are straight; by two calibrations they bend as the lenses do, null without rays.
    """
    a, b, size_a, size_b = body.calibration_a, body.calibration_b, body.image_size_a, body.image_size_b
    if body.matrix is not None and size_a is not None and size_b is not None and a is None and b is None:
        return Json(lines_by_matrix(body.matrix, body.points_a, body.points_b, ImageSize.of(size_a),
                                    ImageSize.of(size_b)))
    if body.matrix is None and a is not None and b is not None:
        get = services.store.calibrations.get
        return Json(lines_by_calibrations(get(a), get(b), body.points_a, body.points_b, body.z_mm))
    raise BadInput("The request has no source for the lines.",
                   "Send a matrix and both image sizes, or two calibrations.", reason="one-sided")
