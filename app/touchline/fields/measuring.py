"""A field as it is: its lines moved to where a tape or a calibration has found them, and all that hangs on them along.

    JoinedField(field).moved({"goal-line-right": (15.0, 15.0)}, {"centre-circle": (2.0, 0.0, 0.0)})

Where lines met they meet again, ends that lay on a line lie on it, landmarks stay on their lines and arcs, edges of
regions stay along theirs, and the size is that between the outer lines.

    adjust_to_tape(field, (TapeDistance("corner-top-left", "corner-top-right", 9015.0),))

A network adjustment: every line may lie aside and askew, every arc elsewhere and wider, and the measured distances
between landmarks say how. What no tape tells stays where the rules have it: the robust loss of the priors leaves most
lines in their places rather than moving all of them a little, which also fixes where the whole field lies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Arc, Field, FieldJson, Landmark, Line, Point, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, Points
from touchline.core.records import Calibration, Warning, WarningJson
from touchline.core.sentences import marking_name
from touchline.core.statements import say
from touchline.fitting.least_squares import Minimum, minimise

Shift = tuple[float, float]  # to the left of a line at its start and at its end, mm
ArcChange = tuple[float, float, float]  # of an arc's radius, and of its centre along x and y, mm

SAME_MM = 1.0  # so near, two places are one
CROSSING = 0.2  # sine of the least angle at which two lines cross in a place that is known

TAPE_SIGMA_MM = 2.0  # σ of one distance
MIN_PRIOR_MM = 3.0  # σ of lines about their places, where the field says that they are exact
STEP_MM = 0.5  # of a derivative by differences
MAX_DISTANCES = 200
MAX_UNKNOWNS = 300  # of 120 lines and 20 arcs: a second or two
MIN_FAR_SIGMAS = 6.0  # of the field's own σ: 18 mm where it says 3
MIN_NOTICED_SIGMAS = 2.0  # of it as well: a smaller move may be as uncertain as it likes
# of a move, its σ: beyond it, whether the line moved at all, or another one, is not known
MAX_SURE_SHARE = 0.5
MAX_RESIDUAL_SIGMAS = 3.0  # of the distance's own σ


class JoinedField:
    """A field, and which of its lines, arcs and landmarks hang together; that is looked up once."""

    def __init__(self, field: Field) -> None:
        self.field = field
        names = list(field.lines)
        ends = np.array([(line.start, line.end) for line in field.lines.values()]).reshape(-1, 2, 2)

        def lines_at(place: Point) -> list[str]:
            return [names[i] for i in np.flatnonzero(_distances(ends, np.asarray(place)) < SAME_MM)]

        self._ends = {
            (name, end): [other for other in lines_at(getattr(line, end)) if other != name]
            for name, line in field.lines.items()
            for end in ("start", "end")
        }
        self._marks = {name: lines_at(mark.position) for name, mark in field.landmarks.items()}
        self._size = [
            (self._line_along(axis, sign * side / 2, -other / 2, other / 2), axis, sign * side / 2)
            for axis, side, other in (
                (0, field.length_mm, field.width_mm),
                (1, field.width_mm, field.length_mm),
            )
            for sign in (1, -1)
        ]

    def moved(self, shifts: Mapping[str, Shift], arcs: Mapping[str, ArcChange]) -> Field:
        """Return the field with those lines and arcs moved, in mm; the others stay."""
        field = self.field
        lines = {
            name: _shifted(line, shifts[name]) if name in shifts else line
            for name, line in field.lines.items()
        }
        rings = {
            name: arc.shifted(arcs[name][0], arcs[name][1:]) if name in arcs else arc
            for name, arc in field.arcs.items()
        }
        joined = {
            name: replace(
                line, start=self._end(lines, name, "start"), end=self._end(lines, name, "end")
            )
            for name, line in lines.items()
        }
        marks = {
            name: Landmark(name, self._carried(lines, rings, name)) for name in field.landmarks
        }
        right, left, top, bottom = (
            _at(lines[name], axis, 0.0) if name else at for name, axis, at in self._size
        )
        return replace(
            field,
            lines=joined,
            arcs=rings,
            landmarks=marks,
            length_mm=right - left,
            width_mm=top - bottom,
            regions={name: self._resized(lines, region) for name, region in field.regions.items()},
        )

    def _end(self, lines: Mapping[str, Line], name: str, end: str) -> Point:
        """Return where a line ends now: on the line that it ended at, else where the shift has taken it."""
        crossings = (_crossing(lines[name], lines[other]) for other in self._ends[name, end])
        return next((there for there in crossings if there is not None), getattr(lines[name], end))

    def _carried(self, lines: Mapping[str, Line], arcs: Mapping[str, Arc], name: str) -> Point:
        """Return where a landmark lies now: where its lines cross, on its line, on its arc, or where it was."""
        place, on = self.field.landmarks[name].position, self._marks[name]
        for one in on[1:]:
            if (there := _crossing(lines[on[0]], lines[one])) is not None:
                return there
        line = lines[on[0]] if on else None
        here = place
        if line is not None:
            before = self.field.lines[on[0]]
            share = float(np.linalg.norm(np.subtract(place, before.start))) / before.length_mm
            here = _point(np.asarray(line.start) * (1 - share) + np.asarray(line.end) * share)
        for arc_name, arc in self.field.arcs.items():
            away = float(np.linalg.norm(np.subtract(place, arc.centre)))
            if abs(away - arc.radius_mm) < SAME_MM:
                return _onto(arcs[arc_name], here, line, arc)
            if away < SAME_MM and line is None:
                return arcs[arc_name].centre
        return here

    def _line_along(self, axis: int, at: float, low: float, high: float) -> str:
        """Name the line along an edge at x (axis 0) or y (1), from end to end; "" where there is none."""
        for name, line in self.field.lines.items():
            ends = sorted((line.start[1 - axis], line.end[1 - axis]))
            if (
                all(abs(end[axis] - at) < SAME_MM for end in (line.start, line.end))
                and ends[0] < low + SAME_MM
                and ends[1] > high - SAME_MM
            ):
                return name
        return ""

    def _resized(self, lines: Mapping[str, Line], region: Region) -> Region:
        def edge(axis: int, at: float, low: float, high: float) -> float:
            name = self._line_along(axis, at, low, high)
            return _at(lines[name], axis, (low + high) / 2) if name else at

        (x0, x1), (y0, y1) = region.x_mm, region.y_mm
        return replace(
            region,
            x_mm=(edge(0, x0, y0, y1), edge(0, x1, y0, y1)),
            y_mm=(edge(1, y0, x0, x1), edge(1, y1, x0, x1)),
        )


def rounded_field(field: Field, digits: int = 1) -> Field:
    """Return the field with places to a tenth of a millimetre, as a tape gives them."""

    def spot(place: Point) -> Point:
        return (round(place[0], digits) + 0.0, round(place[1], digits) + 0.0)

    return replace(
        field,
        length_mm=round(field.length_mm, digits),
        width_mm=round(field.width_mm, digits),
        lines={
            name: replace(line, start=spot(line.start), end=spot(line.end))
            for name, line in field.lines.items()
        },
        arcs={
            name: replace(arc, centre=spot(arc.centre), radius_mm=round(arc.radius_mm, digits))
            for name, arc in field.arcs.items()
        },
        landmarks={
            name: Landmark(name, spot(mark.position)) for name, mark in field.landmarks.items()
        },
        regions={
            name: replace(region, x_mm=spot(region.x_mm), y_mm=spot(region.y_mm))
            for name, region in field.regions.items()
        },
    )


def _distances(lines: Array, place: Points) -> Array:
    """Return how far a place is from each of the lines (n, 2, 2), between their ends."""
    start, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    share = np.clip(np.sum((place - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.linalg.norm(start + share[:, None] * along - place, axis=1)


def _shifted(line: Line, shift: Shift) -> Line:
    start, end = np.asarray(line.start), np.asarray(line.end)
    left = line.normals(start)
    return replace(line, start=_point(start + shift[0] * left), end=_point(end + shift[1] * left))


def _point(place: Array) -> Point:
    return (float(place[0]), float(place[1]))


def _crossing(one: Line, other: Line) -> Point | None:
    """Return where two lines cross, both endless; None where they hardly do."""
    (ax, ay), (bx, by) = (
        np.subtract(one.end, one.start).tolist(),
        np.subtract(other.end, other.start).tolist(),
    )
    sine = ax * by - ay * bx
    if abs(sine) < CROSSING * np.hypot(ax, ay) * np.hypot(bx, by):
        return None
    x, y = other.start[0] - one.start[0], other.start[1] - one.start[1]
    share = (x * by - y * bx) / sine
    return (one.start[0] + share * ax, one.start[1] + share * ay)


def _at(line: Line, axis: int, along: float) -> float:
    """Return a line's x (axis 0) where its y is `along`, or its y (1) at that x."""
    share = (along - line.start[1 - axis]) / (line.end[1 - axis] - line.start[1 - axis])
    return line.start[axis] + share * (line.end[axis] - line.start[axis])


def _onto(arc: Arc, place: Point, line: Line | None, before: Arc) -> Point:
    """Return the place on the moved arc: at the same angle, or where its line meets the arc nearest to it."""
    if line is None:
        arm = np.subtract(place, before.centre) * (arc.radius_mm / before.radius_mm)
        return _point(np.asarray(arc.centre) + arm)
    foot = line.nearest(np.asarray(arc.centre))
    half = np.sqrt(max(0.0, arc.radius_mm**2 - float(np.sum((foot - arc.centre) ** 2))))
    ends = [foot + way * half * line.tangents(foot) for way in (-1.0, 1.0)]
    return _point(min(ends, key=lambda end: float(np.linalg.norm(end - place))))


Offsets = Mapping[str, tuple[float, float | None]]


@dataclass(frozen=True)
class TapeDistance:
    """A distance between two landmarks as it was measured, line middle to line middle."""

    start: str
    end: str
    mm: float
    sigma_mm: float = TAPE_SIGMA_MM


class Offset(TypedDict):
    """How far a marking lies beside its place. sigma_mm: None where it is not known."""

    mm: float
    sigma_mm: float | None


class MeasuredFieldJson(TypedDict):
    """residuals_mm: of each distance, measured less adjusted."""

    field: FieldJson
    offsets: dict[str, Offset]
    residuals_mm: list[float]
    warnings: list[WarningJson]


@dataclass(frozen=True, eq=False)
class MeasuredField:
    """The field as it is, and how far each line and arc lies beside its place, mm, and σ."""

    field: Field
    offsets: Offsets
    residuals_mm: tuple[float, ...] = ()
    warnings: tuple[Warning, ...] = ()

    def to_json(self) -> MeasuredFieldJson:
        return {
            "field": self.field.to_json(),
            "residuals_mm": list(self.residuals_mm),
            "offsets": {
                name: {"mm": mm, "sigma_mm": sigma} for name, (mm, sigma) in self.offsets.items()
            },
            "warnings": [warning.to_json() for warning in self.warnings],
        }


def adjust_to_tape(field: Field, distances: Sequence[TapeDistance]) -> MeasuredField:
    """Return the field that the distances speak for; BadInput for landmarks that it does not have."""
    _check_distances(field, distances)
    measured = np.array([distance.mm for distance in distances])
    sigma = np.array([distance.sigma_mm for distance in distances])
    size = 2 * len(field.lines) + 3 * len(field.arcs)
    named = {
        name: field.landmarks[name]
        for distance in distances
        for name in (distance.start, distance.end)
    }
    used = JoinedField(replace(field, landmarks=named))

    def lengths(state: Array) -> Array:
        marks = used.moved(*_moves(field, state)).landmarks
        return np.array(
            [
                np.hypot(*np.subtract(marks[d.start].position, marks[d.end].position))
                for d in distances
            ]
        )

    # some centimetres in metres change no direction that counts: the derivative at the rules' field does for all
    jacobian = np.stack(
        [(lengths(step) - lengths(-step)) / (2 * STEP_MM) for step in STEP_MM * np.eye(size)],
        axis=1,
    )

    def solve(start: Array, prior_mm: Array) -> Minimum[Array]:
        return minimise(
            start,
            lambda state: (
                np.concatenate([state / prior_mm, (lengths(state) - measured) / sigma]),
                np.concatenate([np.diag(1 / prior_mm), jacobian / sigma[:, None]]),
            ),
            np.add,
            robust_rows=size,
        )

    prior_mm = np.full(size, max(field.line_sigma_mm, MIN_PRIOR_MM))
    first = solve(np.zeros(size), prior_mm).state
    # what surely lies elsewhere is not drawn back
    found = solve(first, np.maximum(prior_mm, np.abs(first)))
    spread = np.sqrt(np.diag(np.linalg.inv(found.jacobian.T @ found.jacobian)))
    moved = JoinedField(field).moved(*_moves(field, found.state))
    offsets, residuals_mm = (
        _offsets(field, found.state, spread),
        tuple((measured - lengths(found.state)).tolist()),
    )
    return _measured(
        moved,
        offsets,
        residuals_mm,
        (
            *_residual_warnings(distances, residuals_mm),
            *_move_warnings(offsets, float(prior_mm[0])),
        ),
    )


def _check_distances(field: Field, distances: Sequence[TapeDistance]) -> None:
    """Raise BadInput for a distance that is not between two landmarks, and for a field that is too large to adjust."""
    for number, distance in enumerate(distances):
        for end, name in (("from", distance.start), ("to", distance.end)):
            if name not in field.landmarks:
                raise BadInput(
                    f"The field has no landmark called {name!r}.",
                    "Use landmarks of the field.",
                    reason="unknown-landmark",
                    entry=f"distances[{number}].{end}",
                )
        if distance.start == distance.end:
            raise BadInput(
                "A distance is measured between two landmarks.",
                "Choose another landmark.",
                reason="unknown-landmark",
                entry=f"distances[{number}].to",
            )
    if 2 * len(field.lines) + 3 * len(field.arcs) > MAX_UNKNOWNS:
        raise BadInput(
            "The field has more lines and arcs than can be adjusted at once.",
            "Remove those that were not measured.",
            reason="too-many-markings",
        )


def as_found(calibration: Calibration, field: Field) -> MeasuredField:
    """Return the field with its lines and arcs where the calibration has found them; Conflict where it knows nothing.

    field: as it is now, which must be the one that the calibration was made for.
    """
    if calibration.field_changes(field.to_json()):
        raise Conflict(
            "The calibration was made before the field was changed.",
            "Calibrate again, then adopt the result.",
            reason="field-changed",
        )
    report = calibration.report
    if not report.get("line_offsets_mm"):
        raise Conflict(
            "This calibration does not determine the positions of the lines.",
            "Calibrate with a physical lens model and with points on more lines than the borders.",
            reason="no-offsets",
        )
    region = field.region(calibration.region, calibration.rotate)
    across = field.as_painted(report, region).line_offsets_mm
    sigmas = field.as_painted(
        {"line_offsets_mm": report.get("line_offset_sigmas_mm")}, region
    ).line_offsets_mm
    centres = report.get("arc_offsets_mm") or {}
    moved = JoinedField(field).moved(
        {name: (across[name], across[name]) for name in field.lines if name in across},
        {name: (across.get(name, 0.0), *centres.get(name, (0.0, 0.0))) for name in field.arcs},
    )
    offsets = {
        name: (across[name], abs(sigmas[name]) if name in sigmas else None)
        for name in (*field.lines, *field.arcs)
        if name in across
    }
    return _measured(
        moved, offsets, (), tuple(_move_warnings(offsets, max(field.line_sigma_mm, MIN_PRIOR_MM)))
    )


def _measured(
    moved: Field, offsets: Offsets, residuals_mm: tuple[float, ...], warnings: tuple[Warning, ...]
) -> MeasuredField:
    """Return the field to a tenth of a millimetre; its lines lie beside their new places by what is not known.

    BadInput where that is no field any more.
    """
    known = [sigma for _, sigma in offsets.values() if sigma is not None]
    sigma_mm = (
        min(moved.line_sigma_mm, round(float(np.median(known)), 1))
        if known
        else moved.line_sigma_mm
    )
    try:
        field = field_from_json(replace(rounded_field(moved), line_sigma_mm=sigma_mm).to_json())
    except BadInput as refused:
        raise BadInput(
            f"The measured distances do not fit any field: {refused.what}",
            "Check whether a distance was read or entered incorrectly, or whether the field type is wrong.",
            reason="bad-measures",
        ) from None
    return MeasuredField(field, offsets, residuals_mm, warnings)


def _moves(field: Field, state: Array) -> tuple[dict[str, Shift], dict[str, ArcChange]]:
    """Return a state's shifts of lines, their middles and how far askew they lie, and its changes of arcs."""
    middles = state[: 2 * len(field.lines)].reshape(-1, 2)
    changes = state[2 * len(field.lines) :].reshape(-1, 3)
    return (
        {
            name: (float(aside - askew), float(aside + askew))
            for name, (aside, askew) in zip(field.lines, middles, strict=True)
        },
        {
            name: (float(r), float(x), float(y))
            for name, (r, x, y) in zip(field.arcs, changes, strict=True)
        },
    )


def _offsets(field: Field, state: Array, spread: Array) -> dict[str, tuple[float, float]]:
    rows = [*range(0, 2 * len(field.lines), 2), *range(2 * len(field.lines), len(state), 3)]
    return {
        name: (float(state[row]), float(spread[row]))
        for name, row in zip((*field.lines, *field.arcs), rows, strict=True)
    }


def _move_warnings(offsets_mm: Offsets, usual_mm: float) -> list[Warning]:
    """Warn of lines and arcs that were moved far, or by no more than is known of it, mm and σ, the furthest first."""
    warnings = []
    for name, (mm, sigma) in sorted(offsets_mm.items(), key=lambda item: -abs(item[1][0])):
        if (
            sigma is not None
            and abs(mm) > MIN_NOTICED_SIGMAS * usual_mm
            and sigma > MAX_SURE_SHARE * abs(mm)
        ):
            warnings.append(
                Warning(
                    "uncertain-move",
                    say(
                        "warning.uncertain-move",
                        "The measurements do not determine where the {line} is: moved by {mm:.0f} ± "
                        "{sigma_mm:.0f} mm.",
                        line=marking_name(name),
                        mm=mm,
                        sigma_mm=sigma,
                    ),
                    say(
                        "warning.uncertain-move.fix",
                        "Measure more distances to this line, from both of its ends.",
                    ),
                    name,
                )
            )
        elif abs(mm) > MIN_FAR_SIGMAS * usual_mm:
            warnings.append(
                Warning(
                    "large-move",
                    say(
                        "warning.large-move",
                        "The {line} was moved by {mm:.0f} mm.",
                        line=marking_name(name),
                        mm=mm,
                    ),
                    say(
                        "warning.large-move.fix",
                        "Check the field type, and measure the distances to this line again.",
                    ),
                    name,
                )
            )
    return warnings


def _residual_warnings(
    distances: Sequence[TapeDistance], residuals_mm: Sequence[float]
) -> list[Warning]:
    """Warn of distances that contradict the others. residuals_mm: of each."""
    return [
        Warning(
            "distance-contradicted",
            say(
                "warning.distance-contradicted",
                "The distance from {start} to {end} differs by {mm:.0f} mm from the others.",
                start=marking_name(distance.start),
                end=marking_name(distance.end),
                mm=mm,
            ),
            say(
                "warning.distance-contradicted.fix",
                "Measure this distance again, or check how it was entered.",
            ),
            index=number,
        )
        for number, (distance, mm) in enumerate(zip(distances, residuals_mm, strict=True))
        if abs(mm) > MAX_RESIDUAL_SIGMAS * distance.sigma_mm
    ]
