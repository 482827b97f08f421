"""Points as a table for spreadsheets: the clicks and where the model maps them, then the model over its region.

    feature,kind,z_mm,raw_x_px,raw_y_px,field_x_mm,field_y_mm

Rows of kind "grid" are computed from the model; the others are clicks, and are read back as such. A field
position as a feature is written "1200 -300".
"""

import csv
import io
from collections.abc import Iterator

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import (
    MAX_POINTS,
    Calibration,
    Observation,
    Observations,
    observations_from_json,
)
from touchline.formats import Format
from touchline.formats.numbers import format_error, number
from touchline.models import RayModel, Restored, field_from_raw, raw_from_field

COLUMNS = ("feature", "kind", "z_mm", "raw_x_px", "raw_y_px", "field_x_mm", "field_y_mm")
GRID = (25, 19)  # columns, rows over the region
MAX_BYTES = 4 << 20


def write(calibration: Calibration, _: Progress = no_progress) -> bytes:
    buffer = io.StringIO()
    table = csv.writer(buffer, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows([_text(cell) for cell in row] for row in _rows(calibration))
    return buffer.getvalue().encode()


def read(data: bytes) -> Observations:
    """Read the clicks, or without any the grid as landmarks. Needs feature, raw_x_px and raw_y_px."""
    if len(data) > MAX_BYTES:
        raise format_error(
            f"The file has {len(data)} bytes. The limit is {MAX_BYTES}.", "Use a shorter file."
        )
    try:
        lines = data.decode("utf-8-sig").splitlines()
        tabs = "\t" in "".join(lines[:1])  # as spreadsheets copy
        rows = csv.reader(lines, delimiter="\t" if tabs else ",")
        header = [name.strip() for name in next(rows, [])]
        if len(header) == 1 and ";" in header[0]:
            raise format_error(
                "The table is separated by semicolons, so its numbers have decimal commas.",
                "Save it with commas between the columns and decimal points.",
            )
        for name in ("feature", "raw_x_px", "raw_y_px"):
            if header.count(name) != 1:
                raise format_error(
                    f"The table has no column {name}.", f"Add the columns {', '.join(COLUMNS)}."
                )
        return _observations(header, rows)
    except (UnicodeDecodeError, csv.Error) as error:
        raise format_error(
            f"The file is not a text table: {str(error)[:100]}.", "Use CSV in UTF-8."
        ) from None


def _rows(calibration: Calibration) -> Iterator[tuple[str | float | None, ...]]:
    model, _, region = Restored.of(calibration)
    for o in observations_from_json(calibration.observations):
        feature = o.feature if isinstance(o.feature, str) else f"{o.feature[0]:g} {o.feature[1]:g}"
        if o.z_mm == 0:
            places = field_from_raw(model, o.points)
        elif isinstance(model, RayModel):
            places = model.unproject(o.points, o.z_mm)
        else:
            places = np.full(o.points.shape, np.nan)
        for point, place in zip(o.points, places, strict=True):
            yield feature, o.kind, o.z_mm, *point, *place
    u, v = np.meshgrid(
        np.linspace(0, region.width_mm, GRID[0]), np.linspace(0, region.height_mm, GRID[1])
    )
    places = region.field_from_region(np.stack([u, v], axis=-1)).reshape(-1, 2)
    for place, point in zip(places, raw_from_field(model, places), strict=True):
        yield f"{place[0]:.10g} {place[1]:.10g}", "grid", 0.0, *point, *place


def _text(cell: str | float | None) -> str:
    """Write a number with all its digits, NaN as nothing, and no text that a spreadsheet would run."""
    if isinstance(cell, str):
        return f"'{cell}" if cell[:1] in ("=", "@", "+") else cell
    return repr(float(cell)) if cell is not None and np.isfinite(cell) else ""


def _observations(header: list[str], rows: Iterator[list[str]]) -> Observations:
    clicked: dict[tuple[str, str, float], list[tuple[float, float]]] = {}
    grid: list[Observation] = []
    for line, row in enumerate(rows, 2):
        if line > MAX_POINTS:
            raise BadInput(
                f"The table has more than {MAX_POINTS} rows.",
                "Use a shorter file.",
                reason="too-many-points",
            )
        if not any(row):
            continue
        at = f"Row {line}"
        if len(row) != len(header):
            raise format_error(
                f"{at} has {len(row)} columns, the first row {len(header)}.",
                "Write numbers with decimal points, and put text with commas in quotes.",
            )
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        if cells.get("kind") == "grid" and not (cells["raw_x_px"] and cells["raw_y_px"]):
            continue  # a place that the picture does not show
        point = (
            number(cells["raw_x_px"], f"{at}, raw_x_px"),
            number(cells["raw_y_px"], f"{at}, raw_y_px"),
        )
        if cells.get("kind") == "grid":
            grid.append(Observation(_position(cells["feature"], at), "landmark", np.array([point])))
            continue
        z_mm = number(cells.get("z_mm") or "0", f"{at}, z_mm", -10_000, 10_000)
        clicked.setdefault((cells["feature"], cells.get("kind") or "line", z_mm), []).append(point)
    return tuple(_observation(*key, points) for key, points in clicked.items()) or tuple(grid)


def _observation(
    feature: str, kind: str, z_mm: float, points: list[tuple[float, float]]
) -> Observation:
    where = (
        _position(feature, "A feature")
        if kind == "landmark" and feature[:1] in "-.0123456789"
        else feature
    )
    return Observation.from_json(
        {
            "feature": list(where) if isinstance(where, tuple) else where,
            "kind": kind,
            "points": [list(p) for p in points],
            "z_mm": z_mm,
        }
    )


def _position(text: str, at: str) -> tuple[float, float]:
    parts = text.split()
    if len(parts) != 2:
        raise format_error(
            f"{at} is not a field position: {text[:40]!r}.", 'Write it as "1200 -300", in mm.'
        )
    return number(parts[0], f"{at}, feature"), number(parts[1], f"{at}, feature")


FORMAT = Format(
    "Points (CSV)",
    "text/csv",
    ".csv",
    "All models: the points, and pixels and millimetres over the covered area.",
    write,
    read,
    recognises=lambda data: b"raw_x_px" in data[:300],
)
