"""A report in the picture turned by quarters: places in the picture move, and no length of it changes.

A turn is exact, so residuals in pixels keep their lengths, those in millimetres everything, and every figure is that of
the fit before it. What is in the picture: where points, their feet and the next best point lie, and the covariance.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.geometry import Array
from touchline.core.json_values import JsonObject
from touchline.core.quarter_turn import QuarterTurn
from touchline.evaluate.uncertainty import covariance_from_json
from touchline.models import CameraModel, model_from_json, parameters_json
from touchline.models.ray_camera import RayCamera
from touchline.models.turned_covariance import Pairs, turned_covariance, turned_terms

PLACES = ("point", "foot")  # of a residual, px


def turned_report(report: Mapping[str, Any], model: CameraModel, turn_deg: int) -> JsonObject:
    """Return the report of the model's own fit as that of the turned model."""
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
