"""What a scene is made of: calibrations by id, those of a rig, or a lens; and the pictures that were clicked."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from starlette.requests import HTTPConnection

from app.api.schemas.scenes import SceneShow
from app.core.errors import BadInput, Conflict, NotFound, TouchlineError
from app.core.opencv import shrink_to_width
from app.core.records import Calibration
from app.images import encode

STILL_PX = 960


@dataclass(frozen=True)
class Shown:
    """given: as app/scene/scene_view.py takes it. calibrations: by key. missing: what could not be shown, with why."""

    given: dict[str, Any]
    calibrations: dict[str, Calibration]
    missing: list[dict[str, str]]


def records_of(connection: HTTPConnection, asked: SceneShow) -> Shown:
    """Everything that is asked for; NotFound for what there is not."""
    state = connection.app.state
    if asked.lens is not None:
        return Shown({"lens": state.store.lenses.get(asked.lens)}, {}, [])
    missing: list[dict[str, str]] = []
    if asked.rig is not None:
        calibrations = []
        for camera in state.store.rigs.get(asked.rig).body["cameras"]:
            active = state.store.calibrations.active(camera["camera"])
            if active is None:
                missing.append({"camera": camera["camera"], "text": f"{title_of(connection, camera['camera'])} has no "
                                "active calibration.", "fix": "Calibrate it, and activate the version."})
            else:
                calibrations.append(active)
        if not calibrations:
            raise Conflict("No camera of this rig is calibrated.", "Calibrate one, and activate the version.",
                           reason="not-calibrated")
    else:
        calibrations = [state.store.calibrations.get(id) for id in dict.fromkeys(asked.calibrations or ())]
    if not calibrations:
        raise BadInput("There is nothing to show.", "Name calibrations, a rig or a lens.", reason="nothing-to-show")
    before = state.store.calibrations.get(asked.before) if asked.before is not None else None
    if before is not None and (len(calibrations) > 1 or before.camera != calibrations[0].camera
                               or before.image_size != calibrations[0].image_size):
        raise Conflict("These two versions are not of one camera at one size.",
                       "Choose an older version of the same camera.", reason="size-mismatch")
    return Shown({"cameras": [{"key": one.id, "title": title_of(connection, one.camera), "calibration": one.to_json(),
                               "before": before.to_json() if before is not None else None} for one in calibrations]},
                 {one.id: one for one in calibrations}, missing)


def title_of(connection: HTTPConnection, camera: str | None) -> str:
    """As the operator calls it."""
    if camera is None:
        return "Camera"
    with suppress(NotFound):  # it was removed since, or was another house's
        return connection.app.state.camera_shelf.get(camera).title
    return camera


def still_of(connection: HTTPConnection, calibration: Calibration) -> bytes | None:
    """The picture that was clicked, small, as a JPEG; None where it is not here any more."""
    if calibration.snapshot is None:
        return None
    try:
        frame = connection.app.state.frames[calibration.snapshot]
    except TouchlineError:
        return None
    return encode(shrink_to_width(frame.pixels, STILL_PX), "jpg") if frame.size == calibration.image_size else None
