"""What jobs keep of their results: a function a kind of result, by the name that a job gives for it.

Each is called with what the job made and with what was said about it, both plain JSON, and its answer is the job's
result. It only saves: it is done within one transaction with the job's end.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from app.core.records import Calibration
from app.store import Store


def result_savers(store: Store) -> dict[str, Callable[[Any, Any], Any]]:
    """Every keeper by its name."""
    def calibration(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        return {"calibration": keep_version(store, Calibration.from_json(made), about["by"]).id}

    def lens(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        record = store.lenses.add({**made, **about})
        return {"lens": record["id"], "record": record}

    def calibrations(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        return {"calibrations": [keep_version(store, Calibration.from_json(one), about["by"]).id
                                 for one in made["made"]]}

    def found_lines(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        kept = made["made"] and keep_version(store, Calibration.from_json(made["made"]), about["by"])
        return {"calibration": kept.id if kept else None, **made["told"]}

    def motion(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        version = made["calibration"] and keep_version(store, Calibration.from_json(made["calibration"]), about["by"])
        kept = store.lenses.add(made["lens"]) if made["lens"] and not version else None  # a refined version has its own
        return {"report": made["report"], "lens": kept and kept["id"], "calibration": version.id if version else None}

    def registered(made: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
        kept = store.calibrations.add(Calibration.from_json(made["made"]),
                                      about["by"])  # the child of what it was made from
        return {"calibration": kept.id, "version": kept.version, "snapshot": kept.snapshot, **made["told"]}

    return {"calibration": calibration, "calibrations": calibrations, "lens": lens, "found-lines": found_lines,
            "registered": registered,
            "motion": motion}


def keep_version(store: Store, made: Calibration, by: str) -> Calibration:
    """A new version of its camera's, the child of the newest before it. by: who asked for it."""
    before = store.calibrations.list(made.camera, limit=1).items if made.camera is not None else ()
    return store.calibrations.add(replace(made, parent=before[0].id if before else None), by)
