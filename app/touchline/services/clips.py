"""Detections in a frame of a saved clip, by the camera's settings and calibration as they are now."""

import math
import time
from collections.abc import Callable
from typing import Any

from touchline.core.colour_profile import ColourProfile
from touchline.core.errors import NotFound
from touchline.core.geometry import Pixels
from touchline.live.detector import detection_json
from touchline.live.stream_spec import DETECTIONS
from touchline.services.container import Services
from touchline.store.stages import named_plan
from touchline.vision.stage_pipeline import StageConfig
from touchline.workflows.detection import colour_profile_for, detections_image, pipeline_for

RAW = "raw"


def detect_in_clip(services: Services, id: str, number: int, plan_name: str | None,
                   stage: str = DETECTIONS) -> tuple[dict[str, Any], Callable[[], Pixels]]:
    """Return detections as a live camera sends them, and what draws them or returns what the stage made of the frame.

    The stages run on one frame alone: what they remember must not depend on which frames were read before.
    """
    clip = services.store.clips.get(id)
    jpeg = services.store.clips.frame(id, number)
    settings = services.detection.saved_frame_settings(clip.camera)
    plan = named_plan(plan_name) if plan_name is not None else StageConfig.from_json(settings["plan"])
    names = [name for name, _ in plan.stages]
    if stage not in (DETECTIONS, *names):
        raise NotFound(f"The plan {plan.name} has no stage called {stage!r}.", f"Use one of: {RAW}, {DETECTIONS}, "
                       f"{', '.join(names)}.", reason="unknown-stage")
    frame = services.decoder.frame_from_bytes(jpeg)
    calibration = services.store.calibrations.active(clip.camera)
    calibration = calibration if calibration is not None and calibration.image_size == frame.size else None
    profile = (ColourProfile.from_json(settings["profile"]) if settings["profile"] is not None
               else colour_profile_for(frame.pixels, plan))
    mm_per_px = None if calibration else settings["extent_mm"] / math.hypot(*frame.size)
    pipeline = pipeline_for(plan, frame.size, profile, calibration, mm_per_px)
    head, pictures = clip.frames[number], () if stage == DETECTIONS else (stage,)
    result = pipeline.process(frame.pixels, clock=time.thread_time, pictures=pictures,
                              camera=clip.camera, frame=head["seq"], time_s=head["time_s"])
    json = detection_json(result, head["seq"], head["time_s"], frame.size, calibration, profile.notes,
                          clip.to_json()["fps"])
    return json, lambda: (detections_image(frame.pixels, result.detections, pipeline.context.view)
                          if stage == DETECTIONS else result.pictures[stage])
