"""Claims of a version by the field's lines: in its own image, in its camera's image now, and which end is which."""

import asyncio
from collections.abc import Sequence
from contextlib import suppress

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Frame
from touchline.evaluate.claims import Claim
from touchline.evaluate.drift.orientation import OrientationReference
from touchline.evaluate.picture_claims import (
    ENDS,
    OWN,
    another_cameras,
    ends_claim,
    lines_claim,
    live_claim,
    no_picture,
    not_live,
    other_size,
)
from touchline.evaluate.site_claims import whose
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.live.camera import SEEN
from touchline.models import Restored, model_of
from touchline.services.claims import camera_of
from touchline.services.container import IsAbandoned, Services
from touchline.services.live import take_frame
from touchline.vision.picture_print import PicturePrint
from touchline.workflows.check import check

LOOK_S = 4.0  # for a frame of a camera that is live


async def line_claims(services: Services, calibration: Calibration, is_abandoned: IsAbandoned) -> list[Claim]:
    """Check the lines in the image that it was made from and in a frame of its camera, taken now; compare the ends."""
    own, live, ends = await asyncio.gather(
        _own_picture(services, calibration, is_abandoned), _live_picture(services, calibration, is_abandoned),
        services.run_in_thread(_ends, services, calibration))
    return [*own, *live, *ends]


async def _own_picture(services: Services, calibration: Calibration, is_abandoned: IsAbandoned) -> Sequence[Claim]:
    """Check the field's lines in the picture that it was made from; once, for neither ever changes."""
    key = (OWN, calibration.id)
    if (kept := services.claims_kept.get(key)) is not None:
        return kept
    if calibration.snapshot is None:
        return [no_picture()]
    try:
        frame = await services.run_in_thread(services.frame, calibration.snapshot)
        found = await services.process_picture(frame.size, lambda progress: check(calibration, frame.pixels, progress),
                                               is_abandoned)
    except TouchlineError as error:  # the picture was deleted or is damaged
        return [Claim(OWN, "not-tested", no_picture().title, error.what, error.fix)]
    return services.claims_kept.put(key, [lines_claim(found)])


async def _live_picture(services: Services, calibration: Calibration, is_abandoned: IsAbandoned) -> list[Claim]:
    """Look at a frame of its camera now; nothing is claimed of a version that belongs to no camera."""
    if calibration.camera is None or await services.run_in_thread(camera_of, services, calibration) is None:
        return []
    camera = services.live.get_running(calibration.camera)
    if camera is None or camera.status()["state"] not in SEEN:
        return [not_live()]
    try:
        taken = await take_frame(camera, LOOK_S)
        frame = await services.run_in_thread(services.decoder.frame_from_bytes, taken.png)
        size = ImageSize(taken.head["width"], taken.head["height"])
        before = await services.run_in_thread(_own_frame, services, calibration)
        found = await services.process_picture(size, lambda progress: check(
            calibration, frame.pixels, progress, None if before is None else before.pixels), is_abandoned)
    except Conflict as error:
        return [other_size(error.what, error.fix)]
    except TouchlineError as error:
        return [not_live(error.what)]
    other = await services.run_in_thread(_whose_picture, services, calibration, frame)
    return [live_claim(found) if other is None else another_cameras(calibration.camera, other)]


def _own_frame(services: Services, calibration: Calibration) -> Frame | None:
    with suppress(TouchlineError):  # deleted, or damaged
        return None if calibration.snapshot is None else services.frame(calibration.snapshot)
    return None


def _whose_picture(services: Services, calibration: Calibration, frame: Frame) -> str | None:
    """Return the name of another camera whose calibration image a picture is nearer to; None for no such."""
    if (now := PicturePrint.of(frame.pixels)) is None:
        return None
    own = services.picture_print(calibration.snapshot)
    for camera in services.cameras.all():
        active = None if camera.id == calibration.camera else services.store.calibrations.active(camera.id)
        if active is not None and active.image_size == frame.size and not _is_over_same_area(active, calibration):
            other = services.picture_print(active.snapshot)
            if other is not None and whose(now, own, other) == "other":
                return camera.title
    return None


def _is_over_same_area(one: Calibration, other: Calibration) -> bool:
    return (one.field["name"], one.region) == (other.field["name"], other.region)


def _ends(services: Services, calibration: Calibration) -> Sequence[Claim]:
    """Compare how the field lies in its picture with the active version's; nothing where its lines tell the ends."""
    if not is_half_turn_symmetric(field_from_json(calibration.field)):
        return []
    active = None if calibration.camera is None else services.store.calibrations.active(calibration.camera)
    if active is None or active.id == calibration.id or not _is_over_same_area(active, calibration):
        return [ends_claim(None, None)]
    return services.claims_kept.get_or_make((ENDS, active.id, calibration.id), lambda: [_ends_against(
        services, calibration, active)])


def _ends_against(services: Services, calibration: Calibration, active: Calibration) -> Claim:
    own, former = _own_frame(services, calibration), _own_frame(services, active)
    if own is None or former is None:
        return ends_claim(None, None)
    model, _, region = Restored.of(active)
    found = OrientationReference.of(former.pixels, model, region).compare(own.pixels, model_of(calibration))
    return ends_claim(found, active.version)
