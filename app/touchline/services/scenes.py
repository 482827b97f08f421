"""What a 3-D scene shows: calibrations by id, those of a rig, or a lens; and the pictures that were calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from touchline.core.common_sentences import CALIBRATE_AND_ACTIVATE, camera_not_calibrated
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.opencv import shrink_to_width
from touchline.core.records import Calibration
from touchline.core.statements import say, stated
from touchline.images import encode
from touchline.services.container import Services

PICTURE_PX = 960


@dataclass(frozen=True)
class SceneContent:
    """records: as the scene's process takes them. calibrations: by key. missing: what cannot be shown, and why."""

    records: dict[str, Any]
    calibrations: dict[str, Calibration]
    missing: list[dict[str, Any]]


def scene_content(services: Services, calibrations: Sequence[str] | None = None, rig: str | None = None,
                  lens: str | None = None, before: str | None = None) -> SceneContent:
    """Read everything that a scene shows; NotFound for what does not exist."""
    store = services.store
    if lens is not None:
        return SceneContent({"lens": store.lenses.get(lens)}, {}, [])
    missing: list[dict[str, Any]] = []
    if rig is not None:
        shown = []
        for camera in store.rigs.get(rig).body["cameras"]:
            active = store.calibrations.active(camera["camera"])
            if active is None:
                title = services.cameras.title(camera["camera"])
                missing.append(stated({"camera": camera["camera"], "text": camera_not_calibrated(title),
                                       "fix": CALIBRATE_AND_ACTIVATE}))
            else:
                shown.append(active)
        if not shown:
            raise Conflict(say("rig.none-calibrated", "No camera of this rig is calibrated."),
                           say("rig.calibrate-one", "Calibrate a camera and activate the version."),
                           reason="not-calibrated")
    else:
        shown = [store.calibrations.get(id) for id in dict.fromkeys(calibrations or ())]
    if not shown:
        raise BadInput(say("scene.nothing", "There is nothing to show."),
                       say("scene.select", "Select calibrations, a rig or a lens."), reason="nothing-to-show")
    older = store.calibrations.get(before) if before is not None else None
    if older is not None and (len(shown) > 1 or older.camera != shown[0].camera
                              or older.image_size != shown[0].image_size):
        raise Conflict(say("scene.versions-differ", "The two versions are not for the same camera and image size."),
                       say("scene.older-version", "Choose an older version of the same camera."),
                       reason="size-mismatch")
    return SceneContent({"cameras": [
        {"key": one.id, "title": title_of(services, one), "calibration": one.to_json(),
         "before": older.to_json() if older is not None else None} for one in shown]},
        {one.id: one for one in shown}, missing)


def title_of(services: Services, calibration: Calibration) -> str:
    """Return the name of the calibration's camera for operators."""
    return "Camera" if calibration.camera is None else services.cameras.title(calibration.camera)


def calibration_jpeg(services: Services, calibration: Calibration) -> bytes | None:
    """Return the picture that was calibrated, small, as a JPEG; None if it is gone."""
    if calibration.snapshot is None:
        return None
    try:
        frame = services.frame(calibration.snapshot)
    except TouchlineError:
        return None
    return encode(shrink_to_width(frame.pixels, PICTURE_PX), "jpg") if frame.size == calibration.image_size else None
