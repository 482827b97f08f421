"""What a calibrated picture shows of a field that the field does not have: its bright lines, in millimetres.

    seen_field(pixels, calibration, field)   the field with what was added
    with_seen(field, chains)                 the same of chains that lie on the carpet already

Pieces of bright chains that lie on one line, or one circle, are put together. Chains are places (n, 2) mm, in pieces:
robots stand on lines, and lines cross. Circles by A. Kåsa's least squares, "A circle fitting procedure and its error
analysis", 1976.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core import opencv
from touchline.core.errors import Conflict
from touchline.core.field import Arc, Field, FieldJson, Line, Point
from touchline.core.geometry import Array, Points, root_mean_square
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Calibration
from touchline.core.sentences import DETECTING_LINES
from touchline.core.statements import say
from touchline.models import field_from_raw, model_of
from touchline.vision.ridges import painted_lines

MAX_OFF_MM = 6.0  # rms of a piece about its line or circle: a lens's error, and a line's own
MAX_BESIDE_MM = 25.0  # so near, two pieces are of one line
# so near a marking that the field has, it is that, its edge, or that of a goal on it
MAX_KNOWN_MM = 60.0
MIN_PARALLEL_COSINE = np.cos(np.radians(1.5))
MAX_GAP_MM = 700.0  # along a line: a robot, or the mouth of another line
MIN_LENGTH_MM = 250.0  # of a line or an arc: shorter is a robot's mark
STEP_MM = 50.0
MIN_PAINTED = 0.5  # of a line that is seen, for it to be one
MAX_JOIN_MM = 100.0  # from a line's end to the line that it ends at
MIN_PLACES = 12
MIN_RADIUS_MM = 100.0  # wider than a robot
# of a circle: what its first piece shows, and all; less may be anything
MIN_PIECE_DEG, MIN_ARC_DEG = 20.0, 45.0
MIN_FULL = 0.5  # of a circle that is seen, for all of it to be there
STEP_DEG = 5.0
# the longest chains: of noise there may be thousands, and each is held against the others
MAX_PIECES = 400
MAX_ADDED = 40  # lines and arcs
MIN_ON_LINE = 0.7  # of a piece, for it to be a line that the field has
MAX_CROSSING_COSINE = 0.7  # between two lines of which one ends at the other
USUAL_WIDTH_MM = 20.0  # of a line, of a field without one


class SeenField(TypedDict):
    """The field with what was added, and the names of that."""

    field: FieldJson
    added: list[str]


def seen_field(
    pixels: NDArray[np.uint8],
    calibration: Calibration,
    field: Field,
    progress: Progress = no_progress,
) -> SeenField:
    """Add the lines and circles that the picture shows; Conflict for a picture of another size.

    The calibration says where the carpet is; it may be one of another field in the same place, such as the borders
    alone.
    """
    if (pixels.shape[1], pixels.shape[0]) != tuple(calibration.image_size):
        raise Conflict(
            say(
                "image.other-size-in-pixels",
                "The image is {width} × {height}; the calibration is for {wanted}.",
                width=pixels.shape[1],
                height=pixels.shape[0],
                wanted=calibration.image_size,
            ),
            say("image.take-that-size", "Take an image of that size."),
            reason="size-mismatch",
        )
    progress(0.0, DETECTING_LINES)
    model, chains = model_of(calibration), painted_lines(opencv.to_grey(pixels)).chains
    progress(0.7, say("progress.measuring-lines", "Measuring lines"))
    on_carpet = [field_from_raw(model, chain) for chain in chains]
    found, names = with_seen(field, [places for places in on_carpet if np.isfinite(places).all()])
    return {"field": found.to_json(), "added": list(names)}


@dataclass(frozen=True, eq=False)
class Straight:
    """The line through some places: middle, unit vector along it."""

    places: Points
    middle: Array
    along: Array
    rms_mm: float

    @classmethod
    def through(cls, places: Points) -> "Straight":
        middle = places.mean(axis=0)
        values, vectors = np.linalg.eigh((places - middle).T @ (places - middle))
        return cls(places, middle, vectors[:, 1], float(np.sqrt(max(values[0], 0.0) / len(places))))

    @property
    def span(self) -> tuple[float, float]:
        at = (self.places - self.middle) @ self.along
        return float(at.min()), float(at.max())

    @property
    def length_mm(self) -> float:
        low, high = self.span
        return high - low

    @property
    def painted_share(self) -> float:
        """How much of the line was seen, in steps along it: of what only lines up, such as crosses, it is little."""
        low, high = self.span
        steps = ((self.places - self.middle) @ self.along - low) // STEP_MM
        return len(np.unique(steps)) / ((high - low) // STEP_MM + 1)

    def is_of(self, other: "Straight") -> bool:
        """Tell whether another piece is of the same line, no further along it than a robot covers."""
        if abs(self.along @ other.along) < MIN_PARALLEL_COSINE:
            return False
        across = (other.places - self.middle) @ np.array([-self.along[1], self.along[0]])
        at = (other.places - self.middle) @ self.along
        low, high = self.span
        gap_mm = max(at.min() - high, low - at.max())
        return bool(np.abs(across).max() < MAX_BESIDE_MM and gap_mm < MAX_GAP_MM)


def with_seen(field: Field, chains: Iterable[Points]) -> tuple[Field, tuple[str, ...]]:
    """Return the field with what the chains show and it does not have, and the names of that, the longest first."""
    far = np.array([field.length_mm, field.width_mm]) / 2 + MAX_BESIDE_MM
    inside = sorted(
        (places for places in chains if (np.abs(places) < far).all()), key=len, reverse=True
    )
    pieces = [piece for places in inside for piece in _pieces(places)][:MAX_PIECES]
    arcs = [
        arc
        for arc in _arcs(pieces, min(far))
        if not any(_is_arc(arc, known) for known in field.arcs.values())
    ]
    on_arcs = (*field.arcs.values(), *arcs)
    straight = [
        piece
        for piece in map(Straight.through, pieces)
        if piece.rms_mm < MAX_OFF_MM and not _lies_on(piece, on_arcs)
    ]
    lines = [
        line
        for line in _merged(straight)
        if line.length_mm > MIN_LENGTH_MM
        and line.painted_share > MIN_PAINTED
        and not _lies_on(line, on_arcs)
        and not any(_is_line(line, known) for known in field.lines.values())
    ]
    seen: list[Line | Arc] = [*_upright(field, lines), *arcs]
    named: dict[str, Line | Arc] = {}
    for marking in sorted(seen, key=lambda one: -one.length_mm)[:MAX_ADDED]:
        name = _free_name(field, named, "line" if isinstance(marking, Line) else "circle")
        named[name] = replace(marking, name=name)
    return replace(
        field,
        lines={**field.lines, **{n: m for n, m in named.items() if isinstance(m, Line)}},
        arcs={**field.arcs, **{n: m for n, m in named.items() if isinstance(m, Arc)}},
    ), tuple(named)


def _merged(pieces: Sequence[Straight]) -> list[Straight]:
    """Put pieces of one line together, the longest first; again until none is left that goes with another."""
    waiting = sorted(pieces, key=lambda piece: -piece.length_mm)
    while True:
        merged: list[Straight] = []
        for piece in waiting:
            found = next((i for i, other in enumerate(merged) if other.is_of(piece)), None)
            if found is None:
                merged.append(piece)
            else:
                merged[found] = Straight.through(
                    np.concatenate([merged[found].places, piece.places])
                )
        if len(merged) == len(waiting):
            return merged
        waiting = sorted(merged, key=lambda piece: -piece.length_mm)


def _pieces(places: Points) -> list[Points]:
    """Cut a chain where it is neither straight nor a circle: it may run from an arc into a line."""
    if len(places) < MIN_PLACES:
        return []
    if Straight.through(places).rms_mm < MAX_OFF_MM or _circle(places) is not None:
        return [places]
    middle = len(places) // 2
    return [*_pieces(places[:middle]), *_pieces(places[middle:])]


def _arcs(pieces: Sequence[Points], largest_mm: float) -> list[Arc]:
    """Fit circles to bent pieces, and one to all pieces that lie on the same."""
    bent = (_circle(places) for places in pieces if Straight.through(places).rms_mm >= MAX_OFF_MM)
    waiting = sorted(
        (arc for arc in bent if arc is not None and MIN_RADIUS_MM < arc.radius_mm < largest_mm),
        key=lambda arc: -arc.length_mm,
    )
    found: list[Arc] = []
    while waiting:
        first = waiting[0]
        on_first = [
            places for places in pieces if _circle_distance_mm(places, first).max() < MAX_BESIDE_MM
        ]
        arc = _circle(np.concatenate(on_first)) or first
        if arc.length_mm > MIN_LENGTH_MM and arc.end_deg - arc.start_deg > MIN_ARC_DEG:
            found.append(arc)
        waiting = [other for other in waiting[1:] if not _is_arc(other, arc)]
    return found


def _circle(places: Points) -> Arc | None:
    """Return the arc through some places; None where they lie on none, or on one that is hardly bent.

    x² + y² = 2 a x + 2 b y + c is linear in the centre (a, b) and in c = r² - a² - b².
    """
    design = np.column_stack([2 * places, np.ones(len(places))])
    (x, y, constant), *_ = np.linalg.lstsq(design, np.sum(places**2, axis=1), rcond=None)
    radius = float(np.sqrt(max(constant + x * x + y * y, 0.0)))
    arms = places - (x, y)
    if root_mean_square(np.linalg.norm(arms, axis=1) - radius) > MAX_OFF_MM:
        return None
    angles = np.sort(np.degrees(np.arctan2(arms[:, 1], arms[:, 0])) % 360)
    gaps = np.diff(np.append(angles, angles[0] + 360))
    widest = int(np.argmax(gaps))  # what was not seen; the arc starts after it
    start, seen = float(angles[(widest + 1) % len(angles)]), 360 - float(gaps[widest])
    if seen < MIN_PIECE_DEG:
        return None
    is_full = len(np.unique(angles // STEP_DEG)) > MIN_FULL * 360 / STEP_DEG
    start = round(start) % 360
    start, end = (0.0, 360.0) if is_full else (start, start + round(seen))
    return Arc("", (_round(x), _round(y)), _round(radius), float(start), float(end))


def _circle_distance_mm(places: Points, arc: Arc) -> Array:
    return np.abs(np.linalg.norm(places - arc.centre, axis=1) - arc.radius_mm)


def _is_arc(one: Arc, known: Arc) -> bool:
    """Tell whether an arc lies on one that is known, or along its edge."""
    return bool(_circle_distance_mm(one.sample(12), known).max() < MAX_KNOWN_MM)


def _is_line(piece: Straight, line: Line) -> bool:
    """Tell whether a piece lies on a line that the field has."""
    low, high = (
        np.minimum(line.start, line.end) - MAX_JOIN_MM,
        np.maximum(line.start, line.end) + MAX_JOIN_MM,
    )
    on = np.linalg.norm(line.nearest(piece.places) - piece.places, axis=1) < MAX_KNOWN_MM
    return bool(
        np.mean(on & ((piece.places >= low) & (piece.places <= high)).all(axis=1)) > MIN_ON_LINE
    )


def _lies_on(piece: Straight, arcs: Iterable[Arc]) -> bool:
    """Tell whether a piece is a stretch of an arc, which is nearly straight."""
    return any(_circle_distance_mm(piece.places, arc).max() < MAX_BESIDE_MM for arc in arcs)


def _upright(field: Field, pieces: Sequence[Straight]) -> list[Line]:
    """Return pieces as lines: along the field's axes where they nearly are, from the line they begin at to the last."""
    width = (
        float(np.median([line.width_mm for line in field.lines.values()]))
        if field.lines
        else USUAL_WIDTH_MM
    )
    lines = []
    for piece in pieces:
        low, high = piece.span
        ends = [piece.middle + at * piece.along for at in (low, high)]
        for axis in (0, 1):
            if abs(piece.along[axis]) > MIN_PARALLEL_COSINE:
                ends = [
                    np.array([end[0], piece.middle[1]] if axis == 0 else [piece.middle[0], end[1]])
                    for end in ends
                ]
        lines.append(Line("", _point(ends[0]), _point(ends[1]), width))
    others = [*field.lines.values(), *lines]
    return [
        replace(line, start=_joined(line.start, line, others), end=_joined(line.end, line, others))
        for line in lines
    ]


def _joined(end: Point, line: Line, others: Iterable[Line]) -> Point:
    """Return the end on the nearest other line that it all but reaches, else where it was seen."""
    nearest, nearest_mm = end, MAX_JOIN_MM
    for other in others:
        foot = other.nearest(np.asarray(end))
        distance_mm = float(np.linalg.norm(foot - end))
        low, high = (
            np.minimum(other.start, other.end) - MAX_JOIN_MM,
            np.maximum(other.start, other.end) + MAX_JOIN_MM,
        )
        crosses = abs(float(other.tangents(foot) @ line.tangents(foot))) < MAX_CROSSING_COSINE
        is_on_other = (foot >= low).all() and (foot <= high).all()
        if other is not line and crosses and distance_mm < nearest_mm and is_on_other:
            nearest, nearest_mm = _point(foot), distance_mm
    return nearest


def _point(place: Array) -> Point:
    return _round(place[0]), _round(place[1])


def _round(value: float) -> float:
    return round(float(value), 1) + 0.0


def _free_name(field: Field, taken: dict[str, Line | Arc], stem: str) -> str:
    known = {*field.lines, *field.arcs, *field.landmarks, *taken}
    return next(name for number in count(1) if (name := f"{stem}-{number}") not in known)
