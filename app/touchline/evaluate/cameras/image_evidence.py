"""The field's own markings, looked for in two pictures where both calibrations expect them: evidence of today.

At even steps along every line and arc that both cameras see, the painted line is measured across its direction, to a
few hundredths of a pixel (vision/lines/snap.py). A camera that was knocked after its calibration shows all of them
beside their place; the other one does not.
"""

import numpy as np

from touchline.core.field import Arc, Field, Line
from touchline.core.geometry import Array, ImageSize, Mask, Pixels, Points, inside_picture
from touchline.core.progress import Progress, no_progress
from touchline.evaluate.cameras.evidence import OffsetMeasurements
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.vision.lines.snap import Hint, Snapped, snap

STEP_MM = 90.0
MAX_PLACES = 160  # of one pair: some milliseconds each
REACH_MM = 120.0  # a camera knocked further shows no line where one is expected
CLEAR_MM = 180.0  # from every other marking: nothing else may be within reach
MIN_REACH_PX, MAX_REACH_PX = 6.0, 30.0
SURE_PX = 0.5
CONFIDENT = 0.6
TINY_MM = 1.0


def marking_places(field: Field) -> tuple[Points, Points, Array]:
    """Places (n, 2) mm on the markings, clear of the others, their normals (n, 2) and the markings' widths (n,) mm."""
    shapes: list[Line | Arc] = [*field.lines.values(), *field.arcs.values()]
    drawn = [shape.sample(max(2, round(shape.length_mm / 20))) for shape in shapes]
    # spots that are painted, where a line crosses none
    marks = [np.array([field.landmarks[m["at"]].position]) for m in field.extras.get("marks", ())
             if m.get("at") in field.landmarks]
    found = [(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))]
    for index, shape in enumerate(shapes):
        places = shape.sample(max(3, round(shape.length_mm / STEP_MM) + 1))
        normals = shape.normals(places)
        others = [points for other, points in enumerate(drawn) if other != index]
        away = np.min([np.linalg.norm(places[:, None] - points, axis=-1).min(axis=1) for points in (*others, *marks)],
                      axis=0, initial=np.inf)
        ends = 0.0 if isinstance(shape, Arc) else CLEAR_MM  # a line's end is a corner, or nothing
        to_end = np.minimum(*(np.linalg.norm(places - end, axis=1) for end in (places[0], places[-1])))
        clear = (away > CLEAR_MM) & (to_end >= ends)
        found.append((places[clear], normals[clear], np.full(int(clear.sum()), shape.width_mm)))
    spots, across, widths = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return spots, across, widths


def from_pictures(a: CameraModel, pixels_a: Pixels, b: CameraModel, pixels_b: Pixels, field: Field,
                  progress: Progress = no_progress) -> OffsetMeasurements:
    """Markings that both pictures show where both see the carpet. No evidence at all is no error here."""
    places, normals, widths = marking_places(field)
    visible = _inside(a, pixels_a, places) & _inside(b, pixels_b, places)
    which = np.flatnonzero(visible)
    which = which[np.linspace(0, len(which) - 1, min(len(which), MAX_PLACES)).round().astype(int)]
    own = np.full((2, len(which)), np.nan)
    for number, index in enumerate(which):
        if number % 16 == 0:
            progress(number / len(which), "Detecting lines visible to both cameras")
        for side, (model, pixels) in enumerate(((a, pixels_a), (b, pixels_b))):
            own[side, number] = _off_mm(model, pixels, places[index], normals[index], widths[index])
            if np.isnan(own[side, number]):
                break
    return OffsetMeasurements.of_lines(places[which], normals[which], *own)


def _inside(model: CameraModel, pixels: Pixels, places: Points) -> Mask:
    return inside_picture(raw_from_field(model, places), ImageSize(pixels.shape[1], pixels.shape[0]), 2)


def _off_mm(model: CameraModel, pixels: Pixels, place: Points, normal: Points, width_mm: float) -> float:
    """How far beside the place, along the normal, this camera sees the marking; NaN where it sees none."""
    along = np.array([normal[1], -normal[0]])
    raw = raw_from_field(model, np.stack([place, place + TINY_MM * along, place + TINY_MM * normal]))
    tangent, scale = raw[1] - raw[0], float(np.linalg.norm(raw[2] - raw[0]))  # px, px a mm
    if not (np.isfinite(raw).all() and scale > 0):
        return float("nan")
    reach = float(np.clip(REACH_MM * scale, MIN_REACH_PX, MAX_REACH_PX))
    found = snap(pixels, raw[0], Hint(reach, width_mm * scale, float(np.arctan2(tangent[1], tangent[0]) % np.pi)))
    if not isinstance(found, Snapped) or found.sigma_px > SURE_PX or found.confidence < CONFIDENT:
        return float("nan")
    return float((field_from_raw(model, np.array(found.point)) - place) @ normal)
