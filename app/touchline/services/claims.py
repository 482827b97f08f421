"""Claims of a version gathered, the site's before a match, and the one way in which a version becomes active."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from touchline.capabilities import CAPABILITIES, loaded_by_name
from touchline.core.errors import Conflict, TouchlineError
from touchline.core.json_values import number
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.evaluate.claims import (
    Claim,
    difference_claims,
    field_claims,
    problems,
    report_claims,
)
from touchline.evaluate.site_claims import CameraImage, SiteCamera, camera_claims
from touchline.live.messages import CameraStatus
from touchline.models import Restored, model_of
from touchline.services.container import IsAbandoned, Services
from touchline.settings import CameraSettings
from touchline.sources import device_of
from touchline.vision.picture_print import PicturePrint
from touchline.workflows import calibration as workflow

log = logging.getLogger("touchline")
FindClaims = Callable[[Services, Calibration, IsAbandoned], Awaitable[list[Claim]]]


def known_claims(services: Services, calibration: Calibration) -> list[Claim]:
    """Return what is known of a version without looking at a picture. It reads the store: call it from a thread."""
    camera, changes = camera_of(services, calibration), services.cameras.field_changes(calibration)
    if camera is None:
        return [*field_claims(calibration, changes, None, None, None), *report_claims(calibration)]
    active = services.store.calibrations.active(calibration.camera)
    other = None if active is None or active.id == calibration.id else active
    return [
        *field_claims(calibration, changes, camera.field, camera.region, other),
        *report_claims(calibration),
    ]


async def all_claims(
    services: Services, calibration: Calibration, is_abandoned: IsAbandoned
) -> list[Claim]:
    """Return every claim, after looking at its picture, at its camera now, and at other versions."""

    async def claims_of(name: str, find: FindClaims) -> list[Claim]:
        try:
            return await find(services, calibration, is_abandoned)
        except Exception as error:
            return package_failed(name, error)

    found = await asyncio.gather(
        *(claims_of(name, find) for name, find in loaded_by_name("claims"))
    )
    return [claim for claims in found for claim in claims]


def package_failed(name: str, error: Exception) -> list[Claim]:
    """Return that the checks of an installed package could not be made, and log it; raise an error of our own."""
    if name in CAPABILITIES:
        raise error
    log.error("The checks of %r failed.", name, exc_info=error)
    return [
        Claim(
            f"package-{name}",
            "not-tested",
            say("claim.package", "Not checked by {package}", package=name),
            say("claim.package.failed", "Its checks failed. The log of the server has the error."),
        )
    ]


async def own_claims(
    services: Services, calibration: Calibration, _is_abandoned: IsAbandoned
) -> list[Claim]:
    """Return what is known of a version, and how far it is from the active one."""
    return await services.run_in_thread(
        lambda: [*known_claims(services, calibration), *_against_active(services, calibration)]
    )


def camera_of(services: Services, calibration: Calibration) -> CameraSettings | None:
    """Return the camera of a version; None where it has none, or that was removed."""
    if calibration.camera is not None:
        with suppress(TouchlineError):  # removed since, or another server's
            return services.cameras.get(calibration.camera)
    return None


def _against_active(services: Services, calibration: Calibration) -> Sequence[Claim]:
    active = (
        None
        if calibration.camera is None
        else services.store.calibrations.active(calibration.camera)
    )
    if active is None or active.id == calibration.id:
        return []
    return services.claims_kept.get_or_make(
        ("difference", active.id, calibration.id), partial(_difference, active, calibration)
    )


def _difference(active: Calibration, calibration: Calibration) -> list[Claim]:
    if (
        active.image_size != calibration.image_size
        or active.field["name"] != calibration.field["name"]
    ):
        return []  # of other pictures or another field: what they differ by is no length
    model, _, region = Restored.of(active)
    return difference_claims(
        workflow.difference(model, model_of(calibration), region), active.version
    )


async def activate(
    services: Services,
    id: str,
    by: str,
    etag: str | None,
    despite: Sequence[str],
    is_abandoned: IsAbandoned,
) -> Calibration:
    """Activate a version; Conflict "problems-found" where claims stand against it that `despite` does not name.

    What was true a moment ago is asked again: its camera may have moved since. etag: as the store takes it. What it
    was activated in spite of is kept in the history, as far as it stood against it.
    """
    store = services.store.calibrations
    calibration = await services.run_in_thread(store.get, id)
    if calibration.active:  # nothing changes
        return calibration
    claims = await all_claims(services, calibration, is_abandoned)
    against = [claim.code for claim in problems(claims)]
    if left := problems(claims, despite):
        raise _refusal(calibration, left, against)
    activated = await services.run_in_thread(store.activate, id, by, etag, against)
    if activated.camera is not None:
        services.live.refresh(activated.camera)
    for part in services.running_parts:
        part.wake()
    return activated


def _refusal(calibration: Calibration, left: Sequence[Claim], against: Sequence[str]) -> Conflict:
    return Conflict(
        say(
            "activation.problems",
            "Version {version} was not activated: {problems}.",
            version=calibration.version,
            problems=[claim.title for claim in left],
        ),
        say("activation.problems.fix", "Mend these problems, or activate it despite them."),
        reason="problems-found",
        claims=[claim.to_json() for claim in left],
        despite=against,
    )


async def readiness(services: Services) -> list[Claim]:
    """Return the site's claims. Cameras are judged by their status; none is started."""
    cameras = await services.run_in_thread(services.cameras.all)
    statuses = {camera.id: services.live.status(camera.id) for camera in cameras}
    running = {camera.id: services.live.get_running(camera.id) for camera in cameras}
    prints = {
        id: None if camera is None else camera.picture_print for id, camera in running.items()
    }
    return await services.run_in_thread(_claims, services, cameras, statuses, prints)


def _claims(
    services: Services,
    cameras: list[CameraSettings],
    statuses: dict[str, CameraStatus],
    prints: dict[str, PicturePrint | None],
) -> list[Claim]:
    own = camera_claims(
        [_camera(services, camera, statuses[camera.id], prints[camera.id]) for camera in cameras]
    )
    return [
        *own,
        *(
            claim
            for name, find in loaded_by_name("site_claims")
            for claim in _found(name, find, services)
        ),
    ]


def _found(name: str, find: Callable[[Services], list[Claim]], services: Services) -> list[Claim]:
    try:
        return find(services)
    except Exception as error:
        return package_failed(name, error)


def _camera(
    services: Services, camera: CameraSettings, status: CameraStatus, now: PicturePrint | None
) -> SiteCamera:
    active = services.store.calibrations.active(camera.id)
    verdict: Any = {} if active is None else active.report.get("verdict") or {}
    against = (
        ()
        if active is None
        else tuple(
            claim
            for claim in field_claims(
                active, services.cameras.field_changes(active), camera.field, camera.region, None
            )
            if claim.is_problem
        )
    )
    image = CameraImage(device_of(camera.source), now, None, None, (camera.field, camera.region))
    if active is not None:
        image = replace(
            image,
            then=services.picture_print(active.snapshot),
            size=active.image_size,
            area=(active.field["name"], active.region),
        )
    return SiteCamera(
        camera.id,
        camera.title,
        status["state"],
        status["problem"],
        active is not None,
        verdict.get("level") or "unknown",
        number(verdict.get("mm")),
        against,
        status["drift"],
        image,
    )
