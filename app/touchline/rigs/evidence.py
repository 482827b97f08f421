"""What two cameras are compared by: matched points and the field's markings in pictures of both, else the clicks.

Pictures are evidence of today. At even steps along every line and arc that both cameras see, the painted line is
measured across its direction where both calibrations expect it, to a few hundredths of a pixel (vision/snap.py).
A camera that was knocked after its calibration shows all of them beside their place; the other one does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Arc, Field, Line
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Pixels, Points, as_matches, inside_picture
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import nullable
from touchline.core.records import Calibration, observations_from_json
from touchline.evaluate.offsets import OffsetMeasurements, from_clicks, from_matches
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.rigs.verdict import Source
from touchline.vision.snap import Hint, Snapped, snap

MIN_MEASURES = 6  # in pictures: fewer are chance
STEP_MM = 90.0
MAX_PLACES = 160  # of one pair: some milliseconds each
REACH_MM = 120.0  # a camera knocked further shows no line where one is expected
CLEAR_MM = 180.0  # from every other marking: nothing else may be within reach
MIN_REACH_PX, MAX_REACH_PX = 6.0, 30.0
SURE_PX = 0.5
CONFIDENT = 0.6
TINY_MM = 1.0


@dataclass(frozen=True, eq=False)
class Matches:
    """a, b (n, 2) raw px, heights_mm (n,), NaN where not known; which (n,): their place among the count given."""

    a: Points
    b: Points
    heights_mm: Array
    which: Indices
    count: int

    @classmethod
    def of(cls, points_a: Any, points_b: Any, z_mm: float | Sequence[float | None]) -> Self:
        """Read them; a point that is None is not marked yet, and such a match counts only in the numbering.

        z_mm above the carpet: of all, or of each, None where it is not known. BadInput bad-matches.
        """
        count = len(points_a)
        which = np.arange(count)
        if isinstance(points_a, list) and isinstance(points_b, list) and len(points_b) == count:
            pairs = zip(points_a, points_b, strict=True)
            which = np.array([i for i, (p, q) in enumerate(pairs) if p is not None and q is not None], np.intp)
            points_a, points_b = ([points[i] for i in which] for points in (points_a, points_b))
        return cls(*as_matches(points_a, points_b), _heights(z_mm, count)[which], which, count)

    def in_given_order(self, values: Array) -> list[float | None]:
        """Put a value of each into the order in which the matches were given."""
        all_values = np.full(self.count, np.nan)
        all_values[self.which] = values
        return nullable(all_values)

    def numbers(self, chosen: Mask | Sequence[int]) -> list[int]:
        return self.which[chosen].tolist()


def _heights(z_mm: float | Sequence[float | None], count: int) -> Array:
    """(count,) mm, NaN where it is not known."""
    if not isinstance(z_mm, Sequence):
        return np.full(count, float(z_mm))
    if len(z_mm) != count:
        raise BadInput(f"There are {len(z_mm)} heights for {count} matches.",
                       "Send one height for all, or one for each match (null if it is unknown).", reason="bad-matches")
    return np.array([np.nan if z is None else float(z) for z in z_mm])


def best_evidence(both: tuple[Calibration, Calibration], models: tuple[CameraModel, CameraModel], field: Field,
                  matches: Matches | None, pictures: tuple[Pixels | None, Pixels | None] = (None, None),
                  progress: Progress = no_progress) -> tuple[OffsetMeasurements, Source, list[str]]:
    """Return the best evidence there is, where it is from, and notes; FitFailed nothing-shared where there is none.

    Matches count as far as their heights are known, and come first: a few of them do not take the place of the lines
    that pictures show, they add what lines do not tell.
    """
    parts: list[OffsetMeasurements] = []
    notes: list[str] = []
    beyond = 0 if matches is None else len(matches.a)  # so that a line has no match's number
    if matches is not None and np.isfinite(matches.heights_mm).any():
        parts.append(from_matches(*models, matches.a, matches.b, matches.heights_mm))
    by_matches = bool(sum(map(len, parts)))
    if pictures[0] is not None and pictures[1] is not None:
        found = from_pictures(models[0], pictures[0], models[1], pictures[1], field, progress)
        if len(found) >= MIN_MEASURES:
            found = replace(found, thing=found.thing + beyond)
            return OffsetMeasurements.together([*parts, found]), "matches" if by_matches else "pictures", notes
        notes.append("The images show too few lines in the area that both cameras cover.")
    if parts:
        return OffsetMeasurements.together(parts), "matches", notes
    a, b = both
    return from_clicks(models[0], observations_from_json(a.observations), field.region(a.region, a.rotate), models[1],
                       observations_from_json(b.observations), field.region(b.region, b.rotate), field), "clicks", notes


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
