"""What teams receive, would receive of a version, and the claims about it."""

from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.records import Calibration
from touchline.evaluate.claims.claim import Claim
from touchline.evaluate.claims.others import packet_claim, publishing_claim
from touchline.services.container import IsAbandoned, Services


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


async def packet_claims(services: Services, calibration: Calibration, _is_abandoned: IsAbandoned) -> list[Claim]:
    """Judge what teams would receive of a version."""
    return [packet_claim(await services.run_in_thread(packet_json, services, calibration))]


def site_claims(services: Services) -> list[Claim]:
    """Return whether teams receive what was calibrated."""
    return [publishing_claim(services.publishing.publisher.status()["state"], services.publishing.warnings)]
