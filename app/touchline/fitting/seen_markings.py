"""Lines and circles of bright chains on the carpet: pieces that lie on one line, or one circle, put together.

    with_seen(field, chains)        the field, and what of the chains it does not have yet

Chains are places (n, 2) mm, in pieces: robots stand on lines, and lines cross. Circles by A. Kåsa's least squares, "A
circle fitting procedure and its error analysis", 1976.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchline.core.field import Arc, Field, Line, Point
from touchline.core.geometry import Array, Points, root_mean_square

OFF_MM = 6.0  # rms of a piece about its line or circle: a lens's error, and a line's own
BESIDE_MM = 25.0  # so near, two pieces are of one line
KNOWN_MM = 60.0  # so near a marking that the field has, it is that, its edge, or that of a goal on it
SAME_WAY = np.cos(np.radians(1.5))
GAP_MM = 700.0  # along a line: a robot, or the mouth of another line
MIN_LENGTH_MM = 250.0  # of a line or an arc: shorter is a robot's mark
STEP_MM = 50.0
PAINTED = 0.5  # of a line that is seen, for it to be one
JOIN_MM = 100.0  # from a line's end to the line that it ends at
MIN_PLACES = 12
MIN_RADIUS_MM = 100.0  # wider than a robot
PIECE_DEG, MIN_DEG = 20.0, 45.0  # of a circle: what its first piece shows, and all of them; less may be anything
FULL = 0.5  # of a circle that is seen, for all of it to be there
STEP_DEG = 5.0
MAX_PIECES = 400  # the longest chains: of noise there may be thousands, and each is held against the others
MAX_ADDED = 40  # lines and arcs


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
        if abs(self.along @ other.along) < SAME_WAY:
            return False
        aside = (other.places - self.middle) @ np.array([-self.along[1], self.along[0]])
        at = (other.places - self.middle) @ self.along
        low, high = self.span
        return bool(np.abs(aside).max() < BESIDE_MM and at.min() - high < GAP_MM and low - at.max() < GAP_MM)


def with_seen(field: Field, chains: Iterable[Points]) -> tuple[Field, tuple[str, ...]]:
    """Return the field with what the chains show and it does not have, and the names of that, the longest first."""
    far = np.array([field.length_mm, field.width_mm]) / 2 + BESIDE_MM
    inside = sorted((places for places in chains if (np.abs(places) < far).all()), key=len, reverse=True)
    pieces = [piece for places in inside for piece in _pieces(places)][:MAX_PIECES]
    arcs = [arc for arc in _arcs(pieces, min(far)) if not any(_is_arc(arc, known) for known in field.arcs.values())]
    on_arcs = (*field.arcs.values(), *arcs)
    straight = [piece for piece in map(Straight.through, pieces)
                if piece.rms_mm < OFF_MM and not _lies_on(piece, on_arcs)]
    lines = [piece for piece in _merged(straight)
             if piece.length_mm > MIN_LENGTH_MM and piece.painted_share > PAINTED and not _lies_on(piece, on_arcs)
             and not any(_is_line(piece, known) for known in field.lines.values())]
    seen: list[Line | Arc] = [*_upright(field, lines), *arcs]
    named: dict[str, Line | Arc] = {}
    for marking in sorted(seen, key=lambda one: -one.length_mm)[:MAX_ADDED]:
        name = _free_name(field, named, "line" if isinstance(marking, Line) else "circle")
        named[name] = replace(marking, name=name)
    return replace(field, lines={**field.lines, **{n: m for n, m in named.items() if isinstance(m, Line)}},
                   arcs={**field.arcs, **{n: m for n, m in named.items() if isinstance(m, Arc)}}), tuple(named)


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
                merged[found] = Straight.through(np.concatenate([merged[found].places, piece.places]))
        if len(merged) == len(waiting):
            return merged
        waiting = sorted(merged, key=lambda piece: -piece.length_mm)


def _pieces(places: Points) -> list[Points]:
    """Cut a chain where it is neither straight nor a circle: it may run from an arc into a line."""
    if len(places) < MIN_PLACES:
        return []
    if Straight.through(places).rms_mm < OFF_MM or _circle(places) is not None:
        return [places]
    middle = len(places) // 2
    return [*_pieces(places[:middle]), *_pieces(places[middle:])]


def _arcs(pieces: Sequence[Points], largest_mm: float) -> list[Arc]:
    """Fit circles to bent pieces, and one to all pieces that lie on the same."""
    bent = (_circle(places) for places in pieces if Straight.through(places).rms_mm >= OFF_MM)
    waiting = sorted((arc for arc in bent if arc is not None and MIN_RADIUS_MM < arc.radius_mm < largest_mm),
                     key=lambda arc: -arc.length_mm)
    found: list[Arc] = []
    while waiting:
        first = waiting[0]
        arc = _circle(np.concatenate([p for p in pieces if _off_mm(p, first).max() < BESIDE_MM])) or first
        if arc.length_mm > MIN_LENGTH_MM and arc.end_deg - arc.start_deg > MIN_DEG:
            found.append(arc)
        waiting = [other for other in waiting[1:] if not _is_arc(other, arc)]
    return found


def _circle(places: Points) -> Arc | None:
    """Return the arc through some places; None where they lie on none, or on one that is hardly bent."""
    design = np.column_stack([2 * places, np.ones(len(places))])
    (x, y, power), *_ = np.linalg.lstsq(design, np.sum(places**2, axis=1), rcond=None)
    radius = float(np.sqrt(max(power + x * x + y * y, 0.0)))
    arms = places - (x, y)
    if root_mean_square(np.linalg.norm(arms, axis=1) - radius) > OFF_MM:
        return None
    angles = np.sort(np.degrees(np.arctan2(arms[:, 1], arms[:, 0])) % 360)
    gaps = np.diff(np.append(angles, angles[0] + 360))
    widest = int(np.argmax(gaps))
    start, seen = float(angles[(widest + 1) % len(angles)]), 360 - float(gaps[widest])
    if seen < PIECE_DEG:
        return None
    is_full = len(np.unique(angles // STEP_DEG)) > FULL * 360 / STEP_DEG
    start = round(start) % 360
    start, end = (0.0, 360.0) if is_full else (start, start + round(seen))
    return Arc("", (_round(x), _round(y)), _round(radius), float(start), float(end))


def _off_mm(places: Points, arc: Arc) -> Array:
    return np.abs(np.linalg.norm(places - arc.centre, axis=1) - arc.radius_mm)


def _is_arc(one: Arc, known: Arc) -> bool:
    """Tell whether an arc lies on one that is known, or along its edge."""
    return bool(_off_mm(one.sample(12), known).max() < KNOWN_MM)


def _is_line(piece: Straight, line: Line) -> bool:
    """Tell whether a piece lies on a line that the field has."""
    low, high = np.minimum(line.start, line.end) - JOIN_MM, np.maximum(line.start, line.end) + JOIN_MM
    on = np.linalg.norm(line.nearest(piece.places) - piece.places, axis=1) < KNOWN_MM
    return bool(np.mean(on & ((piece.places >= low) & (piece.places <= high)).all(axis=1)) > 0.7)


def _lies_on(piece: Straight, arcs: Iterable[Arc]) -> bool:
    """Tell whether a piece is a stretch of an arc, which is nearly straight."""
    return any(_off_mm(piece.places, arc).max() < BESIDE_MM for arc in arcs)


def _upright(field: Field, pieces: Sequence[Straight]) -> list[Line]:
    """Return pieces as lines: along the field's axes where they nearly are, from the line they begin at to the last."""
    width = float(np.median([line.width_mm for line in field.lines.values()])) if field.lines else 20.0
    lines = []
    for piece in pieces:
        low, high = piece.span
        ends = [piece.middle + at * piece.along for at in (low, high)]
        for axis in (0, 1):
            if abs(piece.along[axis]) > SAME_WAY:
                ends = [np.array([end[0], piece.middle[1]] if axis == 0 else [piece.middle[0], end[1]])
                        for end in ends]
        lines.append(Line("", _point(ends[0]), _point(ends[1]), width))
    others = [*field.lines.values(), *lines]
    return [replace(line, start=_joined(line.start, line, others), end=_joined(line.end, line, others))
            for line in lines]


def _joined(end: Point, line: Line, others: Iterable[Line]) -> Point:
    """Return the end on the nearest other line that it all but reaches, else where it was seen."""
    best, nearest = end, JOIN_MM
    for other in others:
        foot = other.nearest(np.asarray(end))
        away = float(np.linalg.norm(foot - end))
        low, high = np.minimum(other.start, other.end) - JOIN_MM, np.maximum(other.start, other.end) + JOIN_MM
        crosses = abs(float(other.tangents(foot) @ line.tangents(foot))) < 0.7
        if other is not line and crosses and away < nearest and (foot >= low).all() and (foot <= high).all():
            best, nearest = _point(foot), away
    return best


def _point(place: Array) -> Point:
    return _round(place[0]), _round(place[1])


def _round(value: float) -> float:
    return round(float(value), 1) + 0.0


def _free_name(field: Field, taken: dict[str, Line | Arc], stem: str) -> str:
    known = {*field.lines, *field.arcs, *field.landmarks, *taken}
    number = 1
    while f"{stem}-{number}" in known:
        number += 1
    return f"{stem}-{number}"
