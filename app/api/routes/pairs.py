"""POST /pairs: two cameras that see the same, judged by matched points, by their calibrations, or by both.

POST /pairs/lines: where a point of one picture can lie in the other, as it is drawn.
"""

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api.answers import Json
from app.api.routes.jobs import result_of
from app.api.schemas import responses
from app.api.schemas.requests import PairLinesRequest, PairRequest
from app.api.work import at_length, at_work
from app.core.errors import BadInput
from app.core.geometry import ImageSize
from app.workflows.pair import lines_by_calibrations, lines_by_matrix, run_pair

router = APIRouter(prefix="/pairs", tags=["judging"])


@router.post("", response_model=responses.Pair)
async def judge_pair(request: Request, body: PairRequest) -> Response:
    """The fundamental matrix of matched points, the pose between two lenses, and the cameras' agreement in mm.

    Each is null where it was not asked for; one that cannot be had is named in `failed`, with its cure.
    """
    store = request.app.state.store
    spec = {"points_a": body.points_a, "points_b": body.points_b, "z_mm": body.z_mm}
    for name, id in (("calibration_a", body.calibration_a), ("calibration_b", body.calibration_b)):
        spec[name] = None if id is None else store.calibrations.get(id).to_json()
    return result_of(await at_length(request, "pair", run_pair, spec))


@router.post("/lines", response_model=responses.PairLines)
async def epipolar_lines(request: Request, body: PairLinesRequest) -> Json:
    """Epipolar lines of points, each in the other picture, and where that shows the same place at `z_mm`.

    By a fundamental `matrix` they are straight; by two calibrations they bend as the lenses do, null without rays.
    """
    ids, sizes = (body.calibration_a, body.calibration_b), (body.image_size_a, body.image_size_b)
    if body.matrix is not None and None not in sizes and ids == (None, None):
        found = await at_work(request, lines_by_matrix, body.matrix, body.points_a, body.points_b,
                              *(ImageSize.of(size) for size in sizes))
    elif body.matrix is None and None not in ids:
        both = (request.app.state.store.calibrations.get(id) for id in ids)
        found = await at_work(request, lines_by_calibrations, *both, body.points_a, body.points_b, body.z_mm)
    else:
        raise BadInput("It is not said what tells the lines.", "Give a matrix and both pictures' sizes, or two "
                       "calibrations.", reason="one-sided")
    return Json(found)
