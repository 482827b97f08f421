"""How results of jobs are saved: functions that the table of capabilities names.

Each gets what the job's function returned and what was given beside its spec, both plain JSON, and returns the job's
result. It runs in one transaction with the job's end, so it does nothing but save.
"""

from contextlib import suppress
from dataclasses import replace

from touchline.core.errors import TouchlineError
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.services.container import Services
from touchline.store.store import Store


def calibration(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save one version."""
    return {
        "calibration": save_new_version(
            services.store, Calibration.from_json(result), about["by"]
        ).id
    }


def calibrations(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save several versions."""
    return {
        "calibrations": [
            save_new_version(services.store, Calibration.from_json(record), about["by"]).id
            for record in result["made"]
        ]
    }


def save_draft_of(store: Store, version: Calibration, by: str) -> None:
    """Put what a version was made of into the draft of its picture: a version without it looks changed since.

    Not where its picture is gone, or an operator has begun on it.
    """
    with suppress(TouchlineError):
        draft = store.drafts.get(str(version.snapshot))
        if not draft.body["observations"]:
            store.drafts.save(draft.snapshot, version.draft(), draft.etag, by)


def save_new_version(store: Store, calibration: Calibration, by: str) -> Calibration:
    """Save a new version of its camera's calibration, the child of the newest before it. by: who asked for it."""
    before = (
        store.calibrations.list(calibration.camera, limit=1).items
        if calibration.camera is not None
        else ()
    )
    return store.calibrations.add(replace(calibration, parent=before[0].id if before else None), by)
