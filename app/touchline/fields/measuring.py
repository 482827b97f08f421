"""A field as it is: its lines moved to where a tape, or a calibration, has found them.

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
from touchline.core.field import Field, FieldJson
from touchline.core.field_json import field_from_json
from touchline.core.field_moves import ArcChange, JoinedField, Shift, rounded_field
from touchline.core.geometry import Array
from touchline.core.records import Calibration, Warning, WarningJson
from touchline.core.sentences import marking_name
from touchline.core.statements import say
from touchline.fitting.least_squares import Minimum, minimise

TAPE_SIGMA_MM = 2.0  # σ of one distance
MIN_PRIOR_MM = 3.0  # σ of lines about their places, where the field says that they are exact
STEP_MM = 0.5  # of a derivative by differences
MAX_DISTANCES = 200
MAX_UNKNOWNS = 300  # of 120 lines and 20 arcs: a second or two
MIN_FAR_SIGMAS = 6.0  # of the field's own σ: 18 mm where it says 3
MIN_NOTICED_SIGMAS = 2.0  # of it as well: a smaller move may be as uncertain as it likes
MAX_SURE_SHARE = 0.5  # of a move, its σ: beyond it, whether the line moved at all, or another one, is not known
MAX_RESIDUAL_SIGMAS = 3.0  # of the distance's own σ

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
        return {"field": self.field.to_json(), "residuals_mm": list(self.residuals_mm),
                "offsets": {name: {"mm": mm, "sigma_mm": sigma} for name, (mm, sigma) in self.offsets.items()},
                "warnings": [warning.to_json() for warning in self.warnings]}


def adjust_to_tape(field: Field, distances: Sequence[TapeDistance]) -> MeasuredField:
    """Return the field that the distances speak for; BadInput for landmarks that it does not have."""
    _check_distances(field, distances)
    measured = np.array([distance.mm for distance in distances])
    sigma = np.array([distance.sigma_mm for distance in distances])
    size = 2 * len(field.lines) + 3 * len(field.arcs)
    named = {name: field.landmarks[name] for distance in distances for name in (distance.start, distance.end)}
    used = JoinedField(replace(field, landmarks=named))

    def lengths(state: Array) -> Array:
        marks = used.moved(*_moves(field, state)).landmarks
        return np.array([np.hypot(*np.subtract(marks[d.start].position, marks[d.end].position)) for d in distances])

    # some centimetres in metres change no direction that counts: the derivative at the rules' field does for all
    jacobian = np.stack([(lengths(step) - lengths(-step)) / (2 * STEP_MM) for step in STEP_MM * np.eye(size)], axis=1)

    def solve(start: Array, prior_mm: Array) -> Minimum[Array]:
        return minimise(start, lambda state: (
            np.concatenate([state / prior_mm, (lengths(state) - measured) / sigma]),
            np.concatenate([np.diag(1 / prior_mm), jacobian / sigma[:, None]])), np.add, robust_rows=size)

    prior_mm = np.full(size, max(field.line_sigma_mm, MIN_PRIOR_MM))
    first = solve(np.zeros(size), prior_mm).state
    found = solve(first, np.maximum(prior_mm, np.abs(first)))  # what surely lies elsewhere is not drawn back
    spread = np.sqrt(np.diag(np.linalg.inv(found.jacobian.T @ found.jacobian)))
    moved = JoinedField(field).moved(*_moves(field, found.state))
    offsets, residuals_mm = _offsets(field, found.state, spread), tuple((measured - lengths(found.state)).tolist())
    return _measured(moved, offsets, residuals_mm, (*_residual_warnings(distances, residuals_mm),
                                                    *_move_warnings(offsets, float(prior_mm[0]))))


def _check_distances(field: Field, distances: Sequence[TapeDistance]) -> None:
    """Raise BadInput for a distance that is not between two landmarks, and for a field that is too large to adjust."""
    for number, distance in enumerate(distances):
        for end, name in (("from", distance.start), ("to", distance.end)):
            if name not in field.landmarks:
                raise BadInput(f"The field has no landmark called {name!r}.", "Use landmarks of the field.",
                               reason="unknown-landmark", entry=f"distances[{number}].{end}")
        if distance.start == distance.end:
            raise BadInput("A distance is measured between two landmarks.", "Choose another landmark.",
                           reason="unknown-landmark", entry=f"distances[{number}].to")
    if 2 * len(field.lines) + 3 * len(field.arcs) > MAX_UNKNOWNS:
        raise BadInput("The field has more lines and arcs than can be adjusted at once.",
                       "Remove those that were not measured.", reason="too-many-markings")


def as_found(calibration: Calibration, field: Field) -> MeasuredField:
    """Return the field with its lines and arcs where the calibration has found them; Conflict where it knows nothing.

    field: as it is now, which must be the one that the calibration was made for.
    """
    if calibration.field_changes(field.to_json()):
        raise Conflict("The calibration was made before the field was changed.",
                       "Calibrate again, then adopt the result.", reason="field-changed")
    report = calibration.report
    if not report.get("line_offsets_mm"):
        raise Conflict("This calibration does not determine the positions of the lines.",
                       "Calibrate with a physical lens model and with points on more lines than the borders.",
                       reason="no-offsets")
    region = field.region(calibration.region, calibration.rotate)
    across = field.as_painted(report, region).line_offsets_mm
    sigmas = field.as_painted({"line_offsets_mm": report.get("line_offset_sigmas_mm")}, region).line_offsets_mm
    centres = report.get("arc_offsets_mm") or {}
    moved = JoinedField(field).moved(
        {name: (across[name], across[name]) for name in field.lines if name in across},
        {name: (across.get(name, 0.0), *centres.get(name, (0.0, 0.0))) for name in field.arcs})
    offsets = {name: (across[name], abs(sigmas[name]) if name in sigmas else None)
               for name in (*field.lines, *field.arcs) if name in across}
    return _measured(moved, offsets, (), tuple(_move_warnings(offsets, max(field.line_sigma_mm, MIN_PRIOR_MM))))


def _measured(moved: Field, offsets: Offsets, residuals_mm: tuple[float, ...],
              warnings: tuple[Warning, ...]) -> MeasuredField:
    """Return the field to a tenth of a millimetre; its lines lie beside their new places by what is not known.

    BadInput where that is no field any more.
    """
    known = [sigma for _, sigma in offsets.values() if sigma is not None]
    sigma_mm = min(moved.line_sigma_mm, round(float(np.median(known)), 1)) if known else moved.line_sigma_mm
    try:
        field = field_from_json(replace(rounded_field(moved), line_sigma_mm=sigma_mm).to_json())
    except BadInput as refused:
        raise BadInput(f"The measured distances do not fit any field: {refused.what}",
                       "Check whether a distance was read or entered incorrectly, or whether the field type is wrong.",
                       reason="bad-measures") from None
    return MeasuredField(field, offsets, residuals_mm, warnings)


def _moves(field: Field, state: Array) -> tuple[dict[str, Shift], dict[str, ArcChange]]:
    """Return a state's shifts of lines, their middles and how far askew they lie, and its changes of arcs."""
    middles = state[:2 * len(field.lines)].reshape(-1, 2)
    changes = state[2 * len(field.lines):].reshape(-1, 3)
    return ({name: (float(aside - askew), float(aside + askew))
             for name, (aside, askew) in zip(field.lines, middles, strict=True)},
            {name: (float(r), float(x), float(y)) for name, (r, x, y) in zip(field.arcs, changes, strict=True)})


def _offsets(field: Field, state: Array, spread: Array) -> dict[str, tuple[float, float]]:
    rows = [*range(0, 2 * len(field.lines), 2), *range(2 * len(field.lines), len(state), 3)]
    return {name: (float(state[row]), float(spread[row]))
            for name, row in zip((*field.lines, *field.arcs), rows, strict=True)}


def _move_warnings(offsets_mm: Offsets, usual_mm: float) -> list[Warning]:
    """Warn of lines and arcs that were moved far, or by no more than is known of it, mm and σ, the furthest first."""
    warnings = []
    for name, (mm, sigma) in sorted(offsets_mm.items(), key=lambda item: -abs(item[1][0])):
        if sigma is not None and abs(mm) > MIN_NOTICED_SIGMAS * usual_mm and sigma > MAX_SURE_SHARE * abs(mm):
            warnings.append(Warning("uncertain-move", say(
                "warning.uncertain-move", "The measurements do not determine where the {line} is: moved by {mm:.0f} ± "
                "{sigma_mm:.0f} mm.", line=marking_name(name), mm=mm, sigma_mm=sigma), say(
                "warning.uncertain-move.fix", "Measure more distances to this line, from both of its ends."), name))
        elif abs(mm) > MIN_FAR_SIGMAS * usual_mm:
            warnings.append(Warning("large-move", say(
                "warning.large-move", "The {line} was moved by {mm:.0f} mm.", line=marking_name(name), mm=mm), say(
                "warning.large-move.fix", "Check the field type, and measure the distances to this line again."), name))
    return warnings


def _residual_warnings(distances: Sequence[TapeDistance], residuals_mm: Sequence[float]) -> list[Warning]:
    """Warn of distances that contradict the others. residuals_mm: of each."""
    return [Warning("distance-contradicted", say(
        "warning.distance-contradicted", "The distance from {start} to {end} differs by {mm:.0f} mm from the others.",
        start=marking_name(distance.start), end=marking_name(distance.end), mm=mm), say(
        "warning.distance-contradicted.fix", "Measure this distance again, or check how it was entered."), index=number)
        for number, (distance, mm) in enumerate(zip(distances, residuals_mm, strict=True))
        if abs(mm) > MAX_RESIDUAL_SIGMAS * distance.sigma_mm]
