"""What was found of a camera, for its picture turned by quarters: a calibration with all that it rests on, or a lens.

Exact, and nothing is fitted. A calibration is right afterwards where the picture alone is turned: of a camera that was
also mounted otherwise, only the lens is known.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from touchline.core.json_values import JsonObject
from touchline.core.quarter_turn import QuarterTurn, turn_in_words
from touchline.core.records import Calibration, observations_from_json
from touchline.evaluate.turned_report import turned_report
from touchline.fitting.ray_camera.lens_prior import DistortionEstimate
from touchline.models import MODELS, model_from_json, model_of, parameters_json
from touchline.models.intrinsics import Intrinsics
from touchline.models.ray_camera import RayCamera
from touchline.models.turned_covariance import turned_terms

MAX_NOTE = 2000  # characters
# of a lens's report: what no turn changes
LENS_FIGURES = ("rms_px", "sigma_px", "max_px", "corners", "strays", "bow_mm", "verdict")


def turned_calibration(calibration: Calibration, turn_deg: int, about: str) -> Calibration:
    """Return the calibration of the picture turned clockwise: model, points, options and report. about: for its note.

    The covered area and its rotation stay: the corrected picture is the same. It has no picture of its own yet.
    """
    model = model_of(calibration)
    turn = QuarterTurn(turn_deg, model.image_size)
    found = model.turned(turn_deg)
    return replace(
        calibration,
        # checked like any that is read
        model_parameters=parameters_json(model_from_json(found.NAME, parameters_json(found))),
        image_size=found.image_size,
        observations=tuple(
            replace(o, points=turn.points(o.points)).to_json()
            for o in observations_from_json(calibration.observations)
        ),
        options=_turned_options(calibration, turn),
        report=turned_report(calibration.report, model, turn_deg),
        snapshot=None,
        image_sha256=None,
        active=False,
        note=f"{about} {calibration.note}".strip()[:MAX_NOTE],
    )


def _turned_options(calibration: Calibration, turn: QuarterTurn) -> JsonObject:
    options, kind = dict(calibration.options), MODELS[calibration.model_name]
    if isinstance(options.get("lens"), Mapping):
        options["lens"] = turned_lens_option(options["lens"], turn.turn_deg)
    if isinstance(options.get("terms"), (list, tuple)) and issubclass(kind, RayCamera):
        options["terms"] = turned_terms(options["terms"], turn, kind.LENS.VECTORS)
    return options


def turned_lens_option(option: Mapping[str, Any], turn_deg: int) -> JsonObject:
    """Return a fit's option "lens" for the turned picture; without its id, which is that of the lens as it was."""
    moved = {name: value for name, value in option.items() if name != "id"}
    if "lens" in option:
        return {**moved, "lens": turned_lens(option["lens"], turn_deg).to_json()}
    model = model_from_json(option["name"], option["parameters"])
    report = turned_report({"covariance": option.get("covariance")}, model, turn_deg)
    covariance = {} if "covariance" not in option else {"covariance": report["covariance"]}
    return {**moved, "parameters": parameters_json(model.turned(turn_deg)), **covariance}


def turned_lens(lens: Any, turn_deg: int) -> Intrinsics | DistortionEstimate:
    """Read a lens's JSON, of a board or of straight lines, and turn it; BadInput for anything else."""
    if isinstance(lens, Mapping) and "unit" in lens:
        return DistortionEstimate.from_json(lens).turned(turn_deg)
    return Intrinsics.from_json(lens).turned(turn_deg)


def turned_lens_record(record: Mapping[str, Any], turn_deg: int) -> JsonObject:
    """Return a lens's record for the turned picture; of its report, what says nothing of places in the picture."""
    lens, report = turned_lens(record.get("lens"), turn_deg), record.get("report")
    figures = (
        {name: report[name] for name in LENS_FIGURES if name in report}
        if isinstance(report, Mapping)
        else {}
    )
    about = f"The lens was {turn_in_words(turn_deg)}."
    return {
        **record,
        "lens": lens.to_json(),
        "image_size": list(lens.image_size),
        "snapshots": None,
        "note": f"{about} {record.get('note') or ''}".strip()[:MAX_NOTE],
        "report": {**figures, "views": [], "warnings": []},
    }
