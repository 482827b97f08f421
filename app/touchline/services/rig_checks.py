"""What is known of rigs while the server runs: the newest check of each, what they track, and how images are joined."""

import json
from collections.abc import Mapping
from typing import Any

from touchline.imaging.mosaic import Stitcher
from touchline.live.track_fusion import TrackFusion
from touchline.services.container import Services
from touchline.services.rig_outdated import NewestCheck
from touchline.store.cache import LruCache
from touchline.store.repository import timestamp, utc_now
from touchline.workflows.rig_types import RigReport

MAX_CHECKS = 200
MAX_STITCHER_BYTES = 128 << 20  # a rig's picture as the page shows it has some 20 MB


class RigState:
    """checks: the newest of each rig. fusions: what each tracks, by its name. stitchers: how its images are joined."""

    def __init__(self, _services: Services) -> None:
        self.checks = RigChecks()
        self.fusions: dict[str, TrackFusion] = {}
        self.stitchers: LruCache[tuple[object, ...], tuple[Stitcher, list[str]]] = LruCache(
            MAX_STITCHER_BYTES, lambda made: made[0].nbytes)


def save_check(services: Services, result: RigReport, context: list[str]) -> RigReport:
    """Keep a check's verdict, and return the check."""
    return services.part(RigState).checks.save(result, context)


class RigChecks:
    """The newest check of each rig, until the rig or a calibration in it is another; forgotten with the server.

    Thread-safe. A rig here is one as touchline/workflows/rig.py takes it.
    """

    def __init__(self) -> None:
        self._newest: LruCache[tuple[str, str], NewestCheck] = LruCache(MAX_CHECKS)

    def context(self, rig: Mapping[str, Any]) -> list[str]:
        """Return what a job needs to keep its result: the rig's name, and what its check depends on."""
        cameras = [[c["camera"], c["region"], c["rotate"], c["calibration"] and c["calibration"]["id"]]
                   for c in rig["cameras"]]
        return [rig["name"], json.dumps([rig["field"], rig["rectangles"], cameras], sort_keys=True)]

    def save(self, result: RigReport, context: list[str]) -> RigReport:
        """Keep a check's verdict, and return the check."""
        found = [pair["agreement"] for pair in result["pairs"] if pair["agreement"] is not None]
        p95 = [part["p95_mm"] for agreement in found for part in (agreement["carpet"], agreement["hat"]) if part]
        name, state = context
        self._newest.put((name, state), {"at": timestamp(utc_now), "verdict": result["verdict"],
                                         "p95_mm": max(p95, default=None)})
        return result

    def get(self, rig: Mapping[str, Any]) -> NewestCheck | None:
        """Return the newest check; None where this rig with these calibrations was not checked."""
        name, state = self.context(rig)
        return self._newest.get((name, state))
