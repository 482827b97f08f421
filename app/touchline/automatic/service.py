"""What detection without clicks leaves in the store."""

from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.services.container import Services
from touchline.services.result_savers import save_new_version


def save_found_lines(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save the version that the detection has made, if it has made one; return its id, and what was found."""
    record = result["made"]
    saved = (
        None
        if record is None
        else save_new_version(services.store, Calibration.from_json(record), about["by"])
    )
    return {"calibration": None if saved is None else saved.id, **result["told"]}
