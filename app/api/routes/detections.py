"""/detections and /stages: ball and robots in a snapshot, each stage's picture, and which stages there are."""

from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from app.api.dependencies import ServicesDep
from app.api.responses import Json, picture
from app.api.routes.pictures import Format
from app.api.schemas.base import Answer
from app.api.schemas.detection import DetectionBody
from app.api.schemas.media import PICTURE
from app.core.colour_profile import ColourProfile
from app.core.errors import NotFound
from app.core.records import Calibration, Frame
from app.services.container import Services
from app.store.stages import load_plans, named_plan
from app.vision.stage_pipeline import StageConfig
from app.vision.stages import STAGES
from app.workflows.detection import DetectionResult, context_for, detect, detections_image

router = APIRouter(tags=["detections"])

DRAWN = "drawn"  # in place of a stage: the picture with everything that was found


@router.get("/stages", response_model=Answer)
def list_stages() -> Json:
    """List every stage with its options, and the plans that come with Touchline."""
    stages = {name: STAGES[name] for name in STAGES}
    return Json({"items": [{"name": name, "title": stage.TITLE, "help": stage.HELP,
                            "options": [option.to_json() for option in stage.OPTIONS]}
                           for name, stage in stages.items()],
                 "plans": [plan.to_json() for plan in load_plans().values()], "next_cursor": None})


@router.post("/detections", response_model=Answer)
async def detect_in_snapshot(services: ServicesDep, body: DetectionBody) -> Json:
    """Detect ball and robots in a snapshot, in field mm with covariance; nothing is saved.

    Colours are those of a profile, clicked in this picture, or both; without either they are found in the picture.
    """
    return Json(await services.run_in_thread(lambda: _detect(services, body)[0].to_json()))


@router.post("/detections/picture.{format}", response_class=Response, responses=PICTURE)
async def draw_detections(services: ServicesDep, format: Format, body: DetectionBody,
                          stage: Annotated[str, Query(max_length=64)] = DRAWN) -> Response:
    """Return the snapshot with detections drawn, or the picture of one stage: `?stage=colours`."""
    return await services.run_in_thread(_draw, services, body, stage, format)


def _detect(services: Services, body: DetectionBody,
            stage: str = DRAWN) -> tuple[DetectionResult, Frame, Calibration | None]:
    plan = named_plan(body.stages) if isinstance(body.stages, str) else StageConfig.from_json(body.stages)
    names = [DRAWN, *(name for name, _ in plan.stages)]
    if stage not in names:
        raise NotFound(f"The plan {plan.name} has no stage called {stage!r}.", f"Use one of: {', '.join(names)}.",
                       reason="unknown-stage")
    calibration = None if body.calibration is None else services.store.calibrations.get(body.calibration)
    profile = None if body.colours is None else ColourProfile.from_json(body.colours)
    frame = services.frame(body.snapshot)
    found = detect(frame.pixels, plan, calibration=calibration, profile=profile, clicks=body.clicks,
                   mm_per_px=body.mm_per_px, eye_mm=body.eye_mm and tuple(body.eye_mm),
                   pictures=() if stage == DRAWN else (stage,))
    return found, frame, calibration


def _draw(services: Services, body: DetectionBody, stage: str, format: str) -> Response:
    found, frame, calibration = _detect(services, body, stage)
    pixels: Any = found.seen.pictures.get(stage)
    if pixels is None:
        view = context_for(frame.size, found.profile, calibration, body.mm_per_px,
                           body.eye_mm and tuple(body.eye_mm)).view
        pixels = detections_image(frame.pixels, found.seen.detections, view)
    return picture(pixels, format)
