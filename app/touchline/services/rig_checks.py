"""The newest check of each rig, until the rig or a calibration in it is another; forgotten with the server."""

import json
from collections.abc import Mapping
from typing import Any

from touchline.services.rig_outdated import NewestCheck
from touchline.store.cache import LruCache
from touchline.store.repository import timestamp, utc_now
from touchline.workflows.rig_types import RigReport

MAX_CHECKS = 200


class RigChecks:
    """Thread-safe. A rig here is one as touchline/workflows/rig.py takes it."""

    def __init__(self) -> None:
        self._newest: LruCache[tuple[str, str], NewestCheck] = LruCache(MAX_CHECKS)

    def context(self, rig: Mapping[str, Any]) -> list[str]:
        """Return what a job needs to keep its result: the rig's name, and what its check depends on."""
        cameras = [[c["camera"], c["region"], c["rotate"], c["calibration"] and c["calibration"]["id"]]
                   for c in rig["cameras"]]
        return [rig["name"], json.dumps([rig["field"], rig["rectangles"], cameras], sort_keys=True)]

    def save(self, result: RigReport, context: list[str]) -> RigReport:
        """Keep a check's verdict, and return the check: a result saver."""
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
