"""How results of jobs are saved: a function for each kind of result, by the name that a job gives for it.

Each gets what the job returned and what was given beside its spec, both plain JSON, and returns the job's result. It
runs in one transaction with the job's end, so it does nothing but save.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from touchline.core.records import Calibration
from touchline.store.store import Store


def result_savers(store: Store) -> dict[str, Callable[[Any, Any], Any]]:
    """Return every saver by its name."""
    def save(record: dict[str, Any] | None, by: str) -> Calibration | None:
        return None if record is None else save_new_version(store, Calibration.from_json(record), by)

    def calibration(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        return {"calibration": _id(save(result, about["by"]))}

    def calibrations(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        return {"calibrations": [_id(save(record, about["by"])) for record in result["made"]]}

    def lens(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        record = store.lenses.add({**result, **about})
        return {"lens": record["id"], "record": record}

    def found_lines(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        return {"calibration": _id(save(result["made"], about["by"])), **result["told"]}

    def motion(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        version = save(result["calibration"], about["by"])
        record = store.lenses.add(result["lens"]) if result["lens"] and not version else None  # a version has its own
        return {"report": result["report"], "lens": record and record["id"], "calibration": _id(version)}

    def registered(result: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        made = Calibration.from_json(result["made"])  # the child of what it was made from
        version = store.calibrations.add(made, about["by"])
        return {"calibration": version.id, "version": version.version, "snapshot": version.snapshot, **result["told"]}

    return {"calibration": calibration, "calibrations": calibrations, "lens": lens, "found-lines": found_lines,
            "registered": registered, "motion": motion}


def _id(calibration: Calibration | None) -> str | None:
    return calibration.id if calibration else None


def save_new_version(store: Store, calibration: Calibration, by: str) -> Calibration:
    """Save a new version of its camera's calibration, the child of the newest before it. by: who asked for it."""
    before = store.calibrations.list(calibration.camera, limit=1).items if calibration.camera is not None else ()
    return store.calibrations.add(replace(calibration, parent=before[0].id if before else None), by)
