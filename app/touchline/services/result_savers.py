"""How results of jobs are saved: functions that the table of capabilities names.

Each gets what the job's function returned and what was given beside its spec, both plain JSON, and returns the job's
result. It runs in one transaction with the job's end, so it does nothing but save.
"""

from dataclasses import replace

from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.services.container import Services
from touchline.store.store import Store


def calibration(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save one version."""
    return {"calibration": _saved(services, result, about)}


def calibrations(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save several versions."""
    return {"calibrations": [_saved(services, record, about) for record in result["made"]]}


def found_lines(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save the version that the automatic detection has made, if it has made one."""
    return {"calibration": _saved(services, result["made"], about), **result["told"]}


def _saved(services: Services, record: JsonObject | None, about: JsonObject) -> str | None:
    """Save a version and return its id; None where there is none."""
    return None if record is None else save_new_version(services.store, Calibration.from_json(record), about["by"]).id


def save_new_version(store: Store, calibration: Calibration, by: str) -> Calibration:
    """Save a new version of its camera's calibration, the child of the newest before it. by: who asked for it."""
    before = store.calibrations.list(calibration.camera, limit=1).items if calibration.camera is not None else ()
    return store.calibrations.add(replace(calibration, parent=before[0].id if before else None), by)
