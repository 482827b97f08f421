"""Whether a match could begin: the claims of all cameras, rigs and of publishing, from what is known now."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from touchline.capabilities import loaded_by_name
from touchline.core.json_values import number
from touchline.evaluate.claims import Claim, field_claims
from touchline.evaluate.site_claims import CameraImage, SiteCamera, camera_claims
from touchline.live.messages import CameraStatus
from touchline.services.claims import package_failed
from touchline.services.container import Services
from touchline.settings import CameraSettings
from touchline.sources import device_of
from touchline.vision.picture_print import PicturePrint


async def readiness(services: Services) -> list[Claim]:
    """Return the site's claims. Cameras are judged by their status; none is started."""
    cameras = await services.run_in_thread(services.cameras.all)
    statuses = {camera.id: services.live.status(camera.id) for camera in cameras}
    running = {camera.id: services.live.get_running(camera.id) for camera in cameras}
    prints = {id: None if camera is None else camera.picture_print for id, camera in running.items()}
    return await services.run_in_thread(_claims, services, cameras, statuses, prints)


def _claims(services: Services, cameras: list[CameraSettings], statuses: dict[str, CameraStatus],
            prints: dict[str, PicturePrint | None]) -> list[Claim]:
    own = camera_claims([_camera(services, camera, statuses[camera.id], prints[camera.id]) for camera in cameras])
    return [*own, *(claim for name, find in loaded_by_name("site_claims") for claim in _found(name, find, services))]


def _found(name: str, find: Callable[[Services], list[Claim]], services: Services) -> list[Claim]:
    try:
        return find(services)
    except Exception as error:
        return package_failed(name, error)


def _camera(services: Services, camera: CameraSettings, status: CameraStatus, now: PicturePrint | None) -> SiteCamera:
    active = services.store.calibrations.active(camera.id)
    verdict: Any = {} if active is None else active.report.get("verdict") or {}
    against = () if active is None else tuple(claim for claim in field_claims(
        active, services.cameras.field_changes(active), camera.field, camera.region, None) if claim.is_problem)
    image = CameraImage(device_of(camera.source), now, None, None, (camera.field, camera.region))
    if active is not None:
        image = replace(image, then=services.picture_print(active.snapshot), size=active.image_size,
                        area=(active.field["name"], active.region))
    return SiteCamera(camera.id, camera.title, status["state"], status["problem"],
                      active is not None, verdict.get("level") or "unknown", number(verdict.get("mm")), against,
                      status["drift"], image)
