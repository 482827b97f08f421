"""Gather the claims of a version: what its report says, and what every capability has tried to refute it."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import partial

from touchline.capabilities import CAPABILITIES, loaded_by_name
from touchline.core.errors import TouchlineError
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.evaluate.claims import Claim, difference_claims, field_claims, report_claims
from touchline.models import Restored, model_of
from touchline.services.container import IsAbandoned, Services
from touchline.settings import CameraSettings
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
    return [*field_claims(calibration, changes, camera.field, camera.region, other), *report_claims(calibration)]


async def all_claims(services: Services, calibration: Calibration, is_abandoned: IsAbandoned) -> list[Claim]:
    """Return every claim, after looking at its picture, at its camera now, and at other versions."""
    async def claims_of(name: str, find: FindClaims) -> list[Claim]:
        try:
            return await find(services, calibration, is_abandoned)
        except Exception as error:
            return package_failed(name, error)

    found = await asyncio.gather(*(claims_of(name, find) for name, find in loaded_by_name("claims")))
    return [claim for claims in found for claim in claims]


def package_failed(name: str, error: Exception) -> list[Claim]:
    """Return that the checks of an installed package could not be made, and log it; raise an error of our own."""
    if name in CAPABILITIES:
        raise error
    log.error("The checks of %r failed.", name, exc_info=error)
    return [Claim(f"package-{name}", "not-tested", say("claim.package", "Not checked by {package}", package=name),
                  say("claim.package.failed", "Its checks failed. The log of the server has the error."))]


async def own_claims(services: Services, calibration: Calibration, _is_abandoned: IsAbandoned) -> list[Claim]:
    """Return what is known of a version, and how far it is from the active one."""
    return await services.run_in_thread(lambda: [*known_claims(services, calibration),
                                                 *_against_active(services, calibration)])


def camera_of(services: Services, calibration: Calibration) -> CameraSettings | None:
    """Return the camera of a version; None where it has none, or that was removed."""
    if calibration.camera is not None:
        with suppress(TouchlineError):  # removed since, or another server's
            return services.cameras.get(calibration.camera)
    return None


def _against_active(services: Services, calibration: Calibration) -> Sequence[Claim]:
    active = None if calibration.camera is None else services.store.calibrations.active(calibration.camera)
    if active is None or active.id == calibration.id:
        return []
    return services.claims_kept.get_or_make(("difference", active.id, calibration.id),
                                            partial(_difference, active, calibration))


def _difference(active: Calibration, calibration: Calibration) -> list[Claim]:
    if active.image_size != calibration.image_size or active.field["name"] != calibration.field["name"]:
        return []  # of other pictures or another field: what they differ by is no length
    model, _, region = Restored.of(active)
    return difference_claims(workflow.difference(model, model_of(calibration), region), active.version)
