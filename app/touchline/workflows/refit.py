"""Fits calibrations again from their kept points: with the rectangles of a rig, or on a field that was changed."""

from typing import Any

from touchline.core.errors import Conflict
from touchline.core.field import BORDERS
from touchline.core.field_json import field_from_json
from touchline.core.jobs import Progress, subprogress
from touchline.core.records import Calibration, observations_from_json
from touchline.core.statements import say
from touchline.workflows.calibration_request import CalibrationRequest


def run_refit(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: each of spec["calibrations"] fitted again, as {"made": [JSON of one not yet stored, …]}.

    spec["rectangles"]: options that replace its own. spec["field"]: the field as it is now, None for that of each; what
    was clicked on markings that it has no more is left out.
    """
    made = []
    for number, one in enumerate(spec["calibrations"]):
        before = Calibration.from_json(one)
        share = subprogress(progress, number / len(spec["calibrations"]), (number + 1) / len(spec["calibrations"]),
                            f"{before.camera}:")
        if not before.observations:
            raise Conflict(say("refit.no-points", "The calibration of {camera} has no points.", camera=before.camera),
                           say("refit.calibrate-again", "It was imported. Calibrate the camera again."),
                           reason="no-observations")
        request = _request(before, spec["rectangles"], spec.get("field"))
        made.append(request.record(request.run(share), parent=before.id).to_json())
    return {"made": made}


def _request(before: Calibration, rectangles: dict[str, Any], field: Any) -> CalibrationRequest:
    options = {**before.options, **rectangles}
    if field is None:
        return CalibrationRequest.of(before, options, "fitted again with the shared calibration grid of its rig")
    now = field_from_json(field)
    known = {*now.lines, *now.arcs, *now.landmarks, *BORDERS}
    kept = tuple(o for o in observations_from_json(before.observations)
                 if not isinstance(o.feature, str) or o.feature in known)
    return CalibrationRequest(kept, now, now.region(before.region, before.rotate), before.image_size,
                              before.model_name, options, before.camera, before.snapshot, before.image_sha256,
                              "fitted again to its points after the field was changed")
