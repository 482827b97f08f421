"""What was found of a camera, for its picture turned by quarters: a calibration with all that it rests on, or a lens.

Exact, and nothing is fitted. A calibration is right afterwards where the picture alone is turned: of a camera that was
also mounted otherwise, only the lens is known.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.geometry import Array
from touchline.core.json_values import JsonObject
from touchline.core.quarter_turn import QuarterTurn, turn_in_words
from touchline.core.records import Calibration, observations_from_json
from touchline.evaluate.uncertainty import covariance_from_json
from touchline.fitting.ray_camera.lens_prior import DistortionEstimate
from touchline.models import MODELS, CameraModel, model_from_json, model_of, parameters_json
from touchline.models.intrinsics import Intrinsics
from touchline.models.ray_camera import RayCamera
from touchline.models.turned_covariance import Pairs, turned_covariance, turned_terms

PLACES = ("point", "foot")  # of a residual, px
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
        report=turned_report(dict(calibration.report), model, turn_deg),
        snapshot=None,
        image_sha256=None,
        active=False,
        note=f"{about} {calibration.note}".strip()[:MAX_NOTE],
    )


def _turned_options(calibration: Calibration, turn: QuarterTurn) -> JsonObject:
    options, kind = dict(calibration.options), MODELS[calibration.model_name]
    if isinstance(options.get("lens"), Mapping):
        options["lens"] = turned_lens_option(dict(options["lens"]), turn.turn_deg)
    if isinstance(options.get("terms"), (list, tuple)) and issubclass(kind, RayCamera):
        options["terms"] = turned_terms(options["terms"], turn, kind.LENS.VECTORS)
    return options


def turned_lens_option(option: JsonObject, turn_deg: int) -> JsonObject:
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


def turned_lens_record(record: JsonObject, turn_deg: int) -> JsonObject:
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


def turned_report(report: JsonObject, model: CameraModel, turn_deg: int) -> JsonObject:
    """Return the report of the model's own fit as that of the turned model.

    The turn is exact, so every length and every figure stays. What is in the picture moves: points, their feet and the
    next best point, and the covariance.
    """
    turn = QuarterTurn(turn_deg, model.image_size)
    moved = dict(report)
    moved["per_feature"] = [
        {
            **row,
            "residuals": [
                {**one, **{name: _moved(one.get(name), turn) for name in PLACES if name in one}}
                for one in row.get("residuals") or ()
            ],
        }
        for row in report.get("per_feature") or ()
    ]
    following = report.get("next_click")
    if isinstance(following, Mapping):
        moved["next_click"] = {**following, "point": _moved(following.get("point"), turn)}
    if report.get("covariance") is not None:
        moved["covariance"] = _turned_covariance(report["covariance"], model, turn_deg)
    terms = report.get("terms")
    if isinstance(terms, Mapping) and isinstance(terms.get("chosen"), (list, tuple)):
        moved["terms"] = {**terms, "chosen": turned_terms(terms["chosen"], turn, _vectors(model))}
    return moved


def _moved(place: Any, turn: QuarterTurn) -> list[float] | None:
    """Return where a pair of pixels is then; None where there is none."""
    return None if place is None else turn.points(np.array(place, float)).tolist()


def _turned_covariance(value: Any, model: CameraModel, turn_deg: int) -> JsonObject | None:
    """Return a report's covariance in the turned picture, and its freer fit; None for one that is not the model's."""
    try:
        known = covariance_from_json(value, model)
        freer = value.get("freer")
        other = None if freer is None else model_from_json(freer["model"], freer["parameters"])
        wider = None if other is None else covariance_from_json(freer, other)
    except (TouchlineError, KeyError, TypeError):
        return None
    moved = _covariance_json(known, model, turn_deg)
    if other is not None and wider is not None:
        turned = other.turned(turn_deg)
        moved["freer"] = {
            "model": other.NAME,
            "parameters": parameters_json(turned),
            **_covariance_json(wider, other, turn_deg),
        }
    return moved


def _covariance_json(
    known: tuple[tuple[str, ...], Array], model: CameraModel, turn_deg: int
) -> JsonObject:
    turn = QuarterTurn(turn_deg, model.image_size)
    aspect = model.aspect if isinstance(model, RayCamera) else 1.0
    names, matrix = turned_covariance(known[0], known[1], turn, _vectors(model), aspect)
    return {"names": list(names), "matrix": matrix.tolist()}


def _vectors(model: CameraModel) -> Pairs:
    return model.LENS.VECTORS if isinstance(model, RayCamera) else ()
