"""Where a fit expects a line of the field in the picture: hints for snapping a click, and points along a line."""

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import BORDERS, Arc, Feature, Field, Landmark, Line, Region
from touchline.core.geometry import ImageSize, Points, inside_picture
from touchline.evaluate.cameras.evidence import same_line
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.vision.snap import Hint, Snapped, snap

SAMPLES = 400
MARGIN_PX = 6.0  # a line is not looked for where its background ends with the picture
ENDS = 0.03  # of the part that is seen: corners belong to two lines
STEP_MM = 5.0
MIN_POINTS = 5  # so many tell which of them is a stray
STRAY_PX = 1.0
BEND = 3  # degree of how far a fit may be off along one line


def line_hints(model: CameraModel, feature: Feature, field: Field, region: Region, points: Points,
               reach_px: float) -> list[Hint]:
    """For each click (n, 2) px on a line or arc, which way the line runs there and how wide it should look."""
    if isinstance(feature, Landmark):
        return [Hint(reach_px)] * len(points)
    places = feature.nearest(field_from_raw(model, points))
    ahead, aside = feature.tangents(places), feature.normals(places)
    width_mm = _width_mm(feature, field)
    before, after = (raw_from_field(model, places + sign * STEP_MM * ahead) for sign in (-1, 1))
    near, far = (raw_from_field(model, places + sign * width_mm / 2 * aside) for sign in (-1, 1))
    angles = np.arctan2(*(after - before).T[::-1])
    widths = np.linalg.norm(far - near, axis=1)
    return [Hint(reach_px, float(width) if np.isfinite(width) and width > 0.2 else None,
                 float(angle) if np.isfinite(angle) else None)
            for angle, width in zip(angles, widths, strict=True)]


def snap_along(pixels: np.ndarray, model: CameraModel, name: str, field: Field, region: Region, count: int,
               reach_px: float) -> list[Snapped]:
    """Up to `count` points of a line or arc, evenly over what the picture shows of it; fewer where it is hidden."""
    feature = field.feature(name, region)
    if isinstance(feature, Landmark):
        raise BadInput(f"{name} is a single landmark. Points can only be found along lines and arcs.",
                       "Click the landmark itself.",
                       reason="not-a-line")
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    places = spread_evenly(raw_from_field(model, feature.sample(SAMPLES)), size, count)
    hints = line_hints(model, feature, field, region, places, reach_px)
    found = [snap(pixels, place, hint) for place, hint in zip(places, hints, strict=True)]
    snapped_at = np.array([isinstance(f, Snapped) for f in found], bool)
    snapped = [f for f in found if isinstance(f, Snapped)]
    steps = np.array([f.point for f in snapped]).reshape(-1, 2) - places[snapped_at]
    aside = np.array([[-np.sin(f.angle_rad), np.cos(f.angle_rad)] for f in snapped]).reshape(-1, 2)
    flips = np.ones(len(aside))  # normals turn with an arc, not over
    for i in range(1, len(aside)):
        flips[i] = flips[i - 1] * (1 if aside[i] @ aside[i - 1] >= 0 else -1)
    fits = _together(np.flatnonzero(snapped_at), flips * np.sum(aside * steps, axis=1))
    return [f for f, ok in zip(snapped, fits, strict=True) if ok]


def spread_evenly(pixels: Points, size: ImageSize, count: int) -> Points:
    """(≤ count, 2) places evenly along what a picture shows of a polyline (n, 2) px, clear of its ends."""
    inside = inside_picture(pixels, size, MARGIN_PX)
    visible = pixels[inside]
    if len(visible) < 2:
        return np.empty((0, 2))
    step = np.linalg.norm(np.diff(visible, axis=0), axis=1)
    step[np.diff(np.flatnonzero(inside)) > 1] = 0.0  # nothing lies in a gap
    travelled = np.concatenate([[0.0], np.cumsum(step)])
    wanted = np.linspace(ENDS, 1 - ENDS, count) * travelled[-1]
    return np.stack([np.interp(wanted, travelled, visible[:, axis]) for axis in (0, 1)], axis=1)


def _width_mm(feature: Line | Arc, field: Field) -> float:
    """As painted: a region's border is as wide as the line that it lies on."""
    if isinstance(feature, Arc) or feature.name not in BORDERS or feature.name in field.lines:
        return feature.width_mm
    return next((line.width_mm for line in field.lines.values() if same_line(line, feature)), feature.width_mm)


def _together(place: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Which points were moved as their neighbours were: a fit is off smoothly, a robot's edge is not."""
    ok = np.ones(len(moved), bool)
    if len(moved) < MIN_POINTS:
        return ok
    for _ in range(5):
        curve = np.polynomial.Polynomial.fit(place[ok], moved[ok], min(BEND, int(ok.sum()) - 3))
        off = np.abs(moved - curve(place))
        limit = max(STRAY_PX, 4 * float(np.median(off[ok])))
        worst = int(np.argmax(np.where(ok, off, 0)))
        if off[worst] <= limit or ok.sum() <= MIN_POINTS:
            break
        ok[worst] = False
    return ok
