"""Clicks moved to the middle of the painted line beside them, and points found along a line of the field."""

import math
from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict

from touchline.core.errors import Conflict
from touchline.core.field import Field, Region
from touchline.core.geometry import Points, as_points
from touchline.core.json_values import PointJson
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.evaluate.next_click import line_hints, snap_along
from touchline.models import CameraModel, model_from_json
from touchline.services.container import Services
from touchline.vision.snap import REASONS, Hint, Snapped, Unsnapped, snap


class SnappedPoint(TypedDict):
    """A click on its line, with what was measured there; or where it is, with the reason."""

    state: Literal["snapped", "kept"]
    point: PointJson
    moved_px: NotRequired[float]
    width_px: NotRequired[float]
    direction_deg: NotRequired[float]
    sigma_px: NotRequired[float]
    confidence: NotRequired[float]
    reason: NotRequired[str]
    what: NotRequired[str]


def snap_clicks(
    services: Services,
    snapshot: str,
    points: list[list[float]],
    reach_px: float,
    width_px: float | None,
    direction_deg: float | None,
    feature: str | None,
    fit: Any,
) -> list[SnappedPoint]:
    """Return each click on its line, or where it is. fit: model, field, region and rotate."""
    frame = services.frame(snapshot)
    clicks = as_points(points, "The points").reshape(-1, 2)
    angle = None if direction_deg is None else math.radians(direction_deg)
    known = [Hint(reach_px, width_px, angle)] * len(clicks)
    if fit is not None and feature is not None:
        model, field, region = _fit(services, fit, frame)
        known = line_hints(model, field.feature(feature, region), field, region, clicks, reach_px)
    return [
        _json(click.tolist(), _snap(frame, click, hint))
        for click, hint in zip(clicks, known, strict=True)
    ]


def points_along(
    services: Services, snapshot: str, fit: Any, feature: str, count: int, reach_px: float
) -> list[SnappedPoint]:
    """Return points along one line of the field, found beside where a fit expects it; none where it is hidden."""
    frame = services.frame(snapshot)
    model, field, region = _fit(services, fit, frame)
    snapped = snap_along(frame.pixels, model, feature, field, region, count, reach_px)
    return [_json(list(one.point), one) for one in snapped]


def _snap(frame: Frame, point: Points, hint: Hint) -> Snapped | Unsnapped:
    """Snap with what is known of the line, then without: a poor fit must not hide a line that is there."""
    snapped = snap(frame.pixels, point, hint)
    blank = Hint(hint.reach_px)
    return (
        snap(frame.pixels, point, blank)
        if isinstance(snapped, Unsnapped) and hint != blank
        else snapped
    )


def _fit(services: Services, fit: Any, frame: Frame) -> tuple[CameraModel, Field, Region]:
    model = model_from_json(fit.model.name, fit.model.parameters)
    if model.image_size != frame.size:
        raise Conflict(
            say(
                "fit.other-image-size",
                "The fit is for {size}, the image has {width} × {height}.",
                size=model.image_size,
                width=frame.size.width,
                height=frame.size.height,
            ),
            say("fit.to-this-image", "Fit the model to this image first."),
            reason="size-mismatch",
        )
    field = services.fields[fit.field]
    return model, field, field.region(fit.region, fit.rotate)


def _json(click: list[float], result: Snapped | Unsnapped) -> SnappedPoint:
    if isinstance(result, Unsnapped):
        return {
            "state": "kept",
            "point": click,
            "reason": result.reason,
            "what": REASONS[result.reason],
        }
    return {
        "state": "snapped",
        "point": list(result.point),
        "moved_px": result.moved_px,
        "width_px": result.width_px,
        "direction_deg": math.degrees(result.angle_rad),
        "sigma_px": result.sigma_px,
        "confidence": result.confidence,
    }
