"""Claims of a version against those of the cameras whose areas touch its own."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from touchline.core.errors import Conflict, FitFailed
from touchline.core.records import Calibration
from touchline.evaluate.claims.claim import Claim
from touchline.evaluate.claims.others import neighbour_claim
from touchline.services.container import IsAbandoned, Services
from touchline.workflows.pair import evaluate_pair


async def neighbour_claims(services: Services, calibration: Calibration, _is_abandoned: IsAbandoned) -> list[Claim]:
    """Compare a version with the active ones of its neighbours; nothing of a version that belongs to no camera."""
    return await services.run_in_thread(_against_neighbours, services, calibration)


def _against_neighbours(services: Services, calibration: Calibration) -> list[Claim]:
    if calibration.camera is None:
        return []
    claims: list[Claim] = []
    for id, title, other in _neighbours(services, calibration):
        claims += services.claims_kept.get_or_make(("neighbour", calibration.id, other.id),
                                                   partial(_neighbour, calibration, id, title, other))
    return claims


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
