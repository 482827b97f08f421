"""POST /pairs: two cameras that see the same, judged by matched points, by their calibrations, or by both."""

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.api import answer_schemas
from app.api.jobs import result_of
from app.api.schemas import PairRequest
from app.api.work import at_length
from app.pair_pipeline import run_pair

router = APIRouter(prefix="/pairs", tags=["judging"])


@router.post("", response_model=answer_schemas.Pair)
async def judge_pair(request: Request, body: PairRequest) -> Response:
    """The fundamental matrix of matched points, the pose between two lenses, and the cameras' agreement in mm.

    Each is null where it was not asked for; one that cannot be had is named in `failed`, with its cure.
    """
    store = request.app.state.store
    spec = {"points_a": body.points_a, "points_b": body.points_b, "z_mm": body.z_mm}
    for name, id in (("calibration_a", body.calibration_a), ("calibration_b", body.calibration_b)):
        spec[name] = None if id is None else store.calibration(id).to_json()
    return result_of(await at_length(request, "pair", run_pair, spec))
