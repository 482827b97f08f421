"""The table: a row for each picture, as CSV, JSON or HTML, and read again by the run that goes on with it."""

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from touchline import __version__
from touchline.core.errors import BadInput
from touchline.report.page import render

Row = dict[str, Any]  # COLUMNS and nothing else
FORMAT, FORMAT_VERSION = "touchline-batch", 1
SUFFIXES = (".csv", ".json", ".html")

COLUMNS: dict[str, tuple[type, str]] = {  # what is in it, and its head on the page
    "picture": (str, "image"),                                 # its name in the folder
    "verdict": (str, "verdict"),                               # good, fair, poor, unknown; failed with a problem
    "judged_by": (str, "judged by"),                           # fit, clicks, edges, clicks and edges
    "held_out_mm": (float, "cross-validated mm"),              # rms of points that the calibration did not know
    "rms_mm": (float, "rms mm"),                               # of all clicks
    "rms_px": (float, "rms px"),
    "worst_mm": (float, "largest error mm"),                   # largest residual, or an edge's bow where that is more
    "distortion_before_pct": (float, "distortion before %"),   # of the border or edge that bows most
    "distortion_after_pct": (float, "after %"),
    "warnings": (list, "warnings"),                            # sentences, each with its cure
    "problem": (str, "problem"),                               # why there are no figures
    "fix": (str, "what to do"),
    "seconds": (float, "s"),
    "sha256": (str, "sha256"),                                 # of the picture's bytes
    "inputs": (str, "inputs"),                                 # of all else that the row rests on; none: do it again
}
BETWEEN = " | "  # warnings within a cell
FORMULA = ("=", "+", "-", "@", "\t")  # a spreadsheet would run a cell that begins so
DATA = re.compile(rb'<script type="application/json" id="table">(.*?)</script>', re.DOTALL)


def row_of(**values: Any) -> Row:
    """Return a row in which all that is not given is empty."""
    return {name: values.get(name, [] if kind is list else "" if kind is str else None)
            for name, (kind, _) in COLUMNS.items()}


def encode_table(rows: Iterable[Row], suffix: str) -> bytes:
    """Return the file, by the ending of its name."""
    return WRITERS[suffix](list(rows)).encode()


def read_table(data: bytes, suffix: str) -> list[Row]:
    """Read what `encode_table` wrote; BadInput for anything else."""
    try:
        text = DATA.findall(data)[0] if suffix == ".html" else data
        if suffix == ".csv":
            lines = csv.reader(io.StringIO(text.decode(), newline=""))
            if next(lines, []) != list(COLUMNS):
                raise ValueError("other columns")
            given = [_from_cells(dict(zip(COLUMNS, cells, strict=True))) for cells in lines]
        else:
            table = json.loads(text)
            if (table["format"], table["format_version"]) != (FORMAT, FORMAT_VERSION):
                raise ValueError(table["format"])
            given = table["rows"]
        return [_checked(row) for row in given]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError, csv.Error):
        raise BadInput("The existing table was not written by batch.", "Choose another file, or omit --resume to "
                       "start again.", reason="bad-table") from None


def _checked(row: Any) -> Row:
    if set(row) != set(COLUMNS):
        raise ValueError("other columns")
    for name, (kind, _) in COLUMNS.items():
        value = row[name]
        number = kind is float and (value is None or (type(value) in (int, float) and math.isfinite(value)))
        if not number and (kind is float or not isinstance(value, kind)):
            raise ValueError(name)
    if not all(isinstance(warning, str) for warning in row["warnings"]):
        raise ValueError("warnings")
    return dict(row)


def _csv(rows: list[Row]) -> str:
    out = io.StringIO(newline="")
    table = csv.writer(out)
    table.writerow(COLUMNS)
    table.writerows([_cell(row[name]) for name in COLUMNS] for row in rows)
    return out.getvalue()


def _cell(value: Any) -> str:
    if value is None or isinstance(value, float):
        return "" if value is None else repr(value)
    text = BETWEEN.join(value) if isinstance(value, list) else str(value)
    return f"'{text}" if text.startswith(FORMULA) else text


def _from_cells(cells: Mapping[str, str]) -> Row:
    def value(name: str, kind: type) -> Any:
        cell = cells[name]
        if kind is float:
            return float(cell) if cell else None
        cell = cell[1:] if cell.startswith("'") and cell[1:].startswith(FORMULA) else cell
        return (cell.split(BETWEEN) if cell else []) if kind is list else cell
    return {name: value(name, kind) for name, (kind, _) in COLUMNS.items()}


def _json(rows: list[Row]) -> str:
    return json.dumps({"format": FORMAT, "format_version": FORMAT_VERSION, "software": f"touchline {__version__}",
                       "rows": rows}, indent=1, allow_nan=False, ensure_ascii=False)


def _html(rows: list[Row]) -> str:
    counts = ", ".join(f"{count} {level}" for level, count in count_verdicts(rows).items()) or "no images"
    return render("batch.html", rows=rows, counts=counts, heads=[head for _, head in COLUMNS.values()],
                  data=_json(rows).replace("<", "\\u003c"))


def count_verdicts(rows: Iterable[Row]) -> dict[str, int]:
    """Count the pictures of each verdict, the best first."""
    levels = [row["verdict"] for row in rows]
    return {level: levels.count(level) for level in ("good", "fair", "poor", "unknown", "failed") if level in levels}


WRITERS = {".csv": _csv, ".json": _json, ".html": _html}
