"""POST /pairs: two cameras that see the same, judged by matched points, by their calibrations, or by both.

POST /pairs/lines: where a point of one picture can lie in the other, as it is drawn.
"""

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.request_mapping import image_size
from app.api.responses import Json, finished_or_queued
from app.api.schemas import responses
from app.api.schemas.lenses import PairLinesRequest, PairRequest
from app.core.errors import BadInput
from app.workflows.pair import lines_by_calibrations, lines_by_matrix, run_pair

router = APIRouter(prefix="/pairs", tags=["judging"])


@router.post("", response_model=responses.Pair)
async def judge_pair(request: Request, services: ServicesDep, body: PairRequest) -> Response:
    """Return the fundamental matrix of matched points, the pose between two lenses, and the cameras' agreement in mm.

    Each is null where it was not requested; one that cannot be computed is named in `failed`, with what to do.
    """
    spec = {"points_a": body.points_a, "points_b": body.points_b, "z_mm": body.z_mm}
    for name, id in (("calibration_a", body.calibration_a), ("calibration_b", body.calibration_b)):
        spec[name] = None if id is None else services.store.calibrations.get(id).to_json()
    return await finished_or_queued(request, services, "pair", run_pair, spec, as_job=False)


@router.post("/lines", response_model=responses.PairLines)
async def epipolar_lines(services: ServicesDep, body: PairLinesRequest) -> Json:
    """Return epipolar lines of points, each in the other picture, and where that shows the same place at `z_mm`.

    By a fundamental `matrix` they are straight; by two calibrations they bend as the lenses do, null without rays.
    """
    ids, sizes = (body.calibration_a, body.calibration_b), (body.image_size_a, body.image_size_b)
    if body.matrix is not None and None not in sizes and ids == (None, None):
        lines = await services.run_in_thread(lines_by_matrix, body.matrix, body.points_a, body.points_b,
                                             *map(image_size, sizes))
    elif body.matrix is None and None not in ids:
        calibrations = (services.store.calibrations.get(id) for id in ids)
        lines = await services.run_in_thread(lines_by_calibrations, *calibrations, body.points_a, body.points_b,
                                             body.z_mm)
    else:
        raise BadInput("It is not said what tells the lines.", "Give a matrix and both pictures' sizes, or two "
                       "calibrations.", reason="one-sided")
    return Json(lines)
