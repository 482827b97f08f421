"""Gather the evidence for the claims of a version: its report, its picture, its camera now, and its neighbours."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from touchline.core.errors import Conflict, FitFailed, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Frame
from touchline.evaluate.claims.claim import Claim
from touchline.evaluate.claims.others import difference_claims, neighbour_claim, packet_claim
from touchline.evaluate.claims.own_images import whose
from touchline.evaluate.claims.own_report import field_claims, report_claims
from touchline.evaluate.claims.pictures import (
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
from touchline.evaluate.drift.orientation import OrientationReference
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.live.camera import SEEN
from touchline.models.restored import Restored, model_of
from touchline.services.container import Services
from touchline.services.live import take_frame
from touchline.vision.picture_print import PicturePrint
from touchline.workflows import calibration as workflow
from touchline.workflows.check import check
from touchline.workflows.pair import evaluate_pair

LOOK_S = 4.0  # for a frame of a camera that is live
IsAbandoned = Callable[[], Awaitable[bool]]


def known_claims(services: Services, calibration: Calibration) -> list[Claim]:
    """Return what is known of a version without looking at a picture. It reads the store: call it from a thread."""
    camera = _camera_of(services, calibration)
    active = services.store.calibrations.active(calibration.camera) if camera is not None else None
    other = None if active is None or active.id == calibration.id else active
    changes = services.cameras.field_changes(calibration)
    return [*field_claims(calibration, changes, camera and camera.field, camera and camera.region, other),
            *report_claims(calibration)]


async def all_claims(services: Services, calibration: Calibration, is_abandoned: IsAbandoned) -> list[Claim]:
    """Return every claim, after looking at its picture, at its camera now, and at other versions."""
    in_thread = services.run_in_thread
    known, lines, live, ends, others, packet = await asyncio.gather(
        in_thread(known_claims, services, calibration), _own_picture(services, calibration, is_abandoned),
        _live_picture(services, calibration, is_abandoned), in_thread(_ends, services, calibration),
        in_thread(_against_others, services, calibration), in_thread(_packet, services, calibration))
    return [*lines, *live, *ends, *known, *packet, *others]


def packet_json(services: Services, calibration: Calibration) -> dict[str, Any]:
    """Return what teams receive of a version: as GET /calibrations/{id}/packet answers."""
    publisher = services.publishing.publisher
    found = publisher.packet_camera(calibration)
    if isinstance(found, TouchlineError):
        nothing = {"exact": False, "loss": None, "expected": None, "fit_expected": None, "level": None}
        return {"calibration": calibration.id, **nothing, "asked": False, "warnings": [], "problem": found.to_json()}
    return {"calibration": calibration.id, **found.to_json(), "asked": found.judged_mm > publisher.config.limit_mm,
            "warnings": [one.to_json() for one in found.warnings(calibration.camera or calibration.id)],
            "problem": None}


def _camera_of(services: Services, calibration: Calibration) -> Any:
    if calibration.camera is not None:
        with suppress(TouchlineError):  # removed since, or another server's
            return services.cameras.get(calibration.camera)
    return None


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
    if calibration.camera is None or await services.run_in_thread(_camera_of, services, calibration) is None:
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


def _against_others(services: Services, calibration: Calibration) -> list[Claim]:
    if calibration.camera is None:
        return []
    active = services.store.calibrations.active(calibration.camera)
    claims: list[Claim] = []
    kept = services.claims_kept.get_or_make
    if active is not None and active.id != calibration.id:
        claims += kept(("difference", active.id, calibration.id), partial(_difference, active, calibration))
    for id, title, other in _neighbours(services, calibration):
        claims += kept(("neighbour", calibration.id, other.id), partial(_neighbour, calibration, id, title, other))
    return claims


def _difference(active: Calibration, calibration: Calibration) -> list[Claim]:
    if active.image_size != calibration.image_size or active.field["name"] != calibration.field["name"]:
        return []  # of other pictures or another field: what they differ by is no length
    model, _, region = Restored.of(active)
    return difference_claims(workflow.difference(model, model_of(calibration), region), active.version)


def _neighbour(calibration: Calibration, id: str, title: str, other: Calibration) -> list[Claim]:
    try:
        agreement = evaluate_pair(None, None, calibration, other)["agreement"]
    except (FitFailed, Conflict):  # they share nothing, or have other fields
        return []
    return [] if agreement is None else [neighbour_claim(id, title, agreement)]


def _neighbours(services: Services, calibration: Calibration) -> Iterator[tuple[str, str, Calibration]]:
    """Yield other cameras over the same field whose areas touch this one: id, name and active version."""
    regions, name = calibration.field["regions"], calibration.field["name"]
    own = regions.get(calibration.region)
    for camera in services.cameras.all():
        if camera.id == calibration.camera or camera.field != name:
            continue
        there = None if camera.region is None else regions.get(camera.region)
        if own is not None and there is not None and not _touch(own, there):
            continue
        if (active := services.store.calibrations.active(camera.id)) is not None:
            yield camera.id, camera.title, active


def _touch(one: Any, other: Any) -> bool:
    return all(max(one[axis]) >= min(other[axis]) and max(other[axis]) >= min(one[axis]) for axis in ("x", "y"))


def _packet(services: Services, calibration: Calibration) -> list[Claim]:
    return [packet_claim(packet_json(services, calibration))]
