"""/detections and /stages: ball and robots in a snapshot, each stage's picture, and which stages there are."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from app.api.answers import Json, picture
from app.api.routes.pictures import ANSWER, Format
from app.api.schemas import responses
from app.api.schemas.detections import DetectionRequest
from app.api.work import at_work
from app.core.colour_profile import ColourProfile
from app.core.errors import NotFound
from app.core.records import Calibration, Frame
from app.store.stages import load_plans, named_plan
from app.vision.stage_pipeline import StageConfig
from app.vision.stages import STAGES
from app.workflows.detection import DetectionResult, context_for, detect, detections_image

router = APIRouter(tags=["detections"])

DRAWN = "drawn"  # in place of a stage: the picture with everything that was found


@router.get("/stages", response_model=responses.Answer)
def list_stages() -> Json:
    """Every stage with its options, and the plans that come with Touchline."""
    return Json({"items": [{"name": name, "title": kind.TITLE, "help": kind.HELP,
                            "options": [option.to_json() for option in kind.OPTIONS]}
                           for name in STAGES for kind in [STAGES[name]]],
                 "plans": [plan.to_json() for plan in load_plans().values()], "next_cursor": None})


@router.post("/detections", response_model=responses.Answer)
async def detect_in_snapshot(request: Request, body: DetectionRequest) -> Json:
    """Ball and robots in a snapshot, in field mm with covariance; nothing is kept.

    Colours are those of a profile, or clicked in this picture, or both; without either they are found in the picture.
    """
    return Json(await at_work(request, lambda: _found(request, body)[0].to_json()))


@router.post("/detections/picture.{format}", response_class=Response, responses=ANSWER)
async def draw_detections(request: Request, format: Format, body: DetectionRequest,
                          stage: Annotated[str, Query(max_length=64)] = DRAWN) -> Response:
    """The snapshot with what was found, or what one stage made of it: `?stage=colours`."""
    return await at_work(request, _drawn, request, body, stage, format)


def _found(request: Request, body: DetectionRequest, stage: str = DRAWN,
           ) -> tuple[DetectionResult, Frame, Calibration | None]:
    state = request.app.state
    plan = named_plan(body.stages) if isinstance(body.stages, str) else StageConfig.from_json(body.stages)
    if stage != DRAWN and stage not in [name for name, _ in plan.stages]:
        raise NotFound(f"The plan {plan.name} has no stage called {stage!r}.",
                       f"Use one of: {', '.join([DRAWN, *(name for name, _ in plan.stages)])}.", reason="unknown-stage")
    calibration = None if body.calibration is None else state.store.calibrations.get(body.calibration)
    profile = None if body.colours is None else ColourProfile.from_json(body.colours)
    frame = state.frames[body.snapshot]
    found = detect(frame.pixels, plan, calibration=calibration, profile=profile, clicks=body.clicks,
                   mm_per_px=body.mm_per_px, eye_mm=_eye(body), pictures=() if stage == DRAWN else (stage,))
    return found, frame, calibration


def _eye(body: DetectionRequest) -> tuple[float, float, float] | None:
    return None if body.eye_mm is None else (body.eye_mm[0], body.eye_mm[1], body.eye_mm[2])


def _drawn(request: Request, body: DetectionRequest, stage: str, format: str) -> Response:
    found, frame, calibration = _found(request, body, stage)
    pixels: Any = found.seen.pictures.get(stage)
    if pixels is None:
        view = context_for(frame.size, found.profile, calibration, body.mm_per_px, _eye(body)).view
        pixels = detections_image(frame.pixels, found.seen.detections, view)
    return picture(pixels, format)
