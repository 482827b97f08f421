"""batch: a folder of pictures, each calibrated or checked, and a table of them."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.batch import (
    SUFFIXES,
    BatchPlan,
    Row,
    count_verdicts,
    encode_table,
    pictures_in,
    read_table,
    run_requests,
)
from touchline.cli import files
from touchline.cli.console import ACCEPTED, USAGE, Enough, exit_code_of, say
from touchline.cli.progress import progress_bar
from touchline.cli.requests import FieldName, Options, OwnFields, RegionName, Rotate, options_from, own_fields, task_of
from touchline.core.errors import BadInput, TouchlineError
from touchline.jobs import JobEngine
from touchline.models import MODELS

BAD, STOPPED = 1, 130
SAVE_EVERY_S = 0.5
MAX_WORKERS = 64

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="The folder with PNG, "
                                        "JPEG, BMP and WebP files.")]
Points = Annotated[Path | None, typer.Option("--points", metavar="CLICKS.json|DIR", exists=True, help="One points "
                                             "file for all images, or a folder of points files. By default "
                                             "PICTURE.json next to each image.")]
Known = Annotated[Path | None, typer.Option("--calibration", "-c", metavar="CAL.json", exists=True, dir_okay=False,
                                            help="Check this calibration against each image.")]
Table = Annotated[Path | None, typer.Option("--output", "-o", metavar="TABLE.csv|.json|.html", help="The table to "
                                            "write.")]
Workers = Annotated[int | None, typer.Option("--workers", min=1, max=MAX_WORKERS, help="Images processed at once. By "
                                             "default the number of cores of this machine.")]
EnoughOfAll = Annotated[Enough, typer.Option("--enough", help=f"Exit code {BAD} for a verdict below this.")]


def batch(folder: Folder, field: FieldName = None, region: RegionName = None, rotate: Rotate = None,
          model: Annotated[str | None, typer.Option("--model", help="Camera model. By default polynomial.")] = None,
          option: Options = None, calibration: Known = None, points: Points = None, output: Table = None,
          resume: Annotated[bool, typer.Option("--resume", help="Continue: reuse the unchanged rows of the "
                                                                "table.")] = False,
          engine: Annotated[str, typer.Option("--engine", help="local, or dask://host:port.")] = "local",
          workers: Workers = None, enough: EnoughOfAll = Enough.fair, fields: OwnFields = None) -> None:
    """Calibrate or check every image of a folder."""
    own = (field, region, rotate, model, option, fields)
    if calibration is not None and any(it is not None for it in own):
        raise typer.BadParameter("it contains its own field, region and model", param_hint="--calibration")
    count = workers or os.cpu_count() or 1
    with _wrong_use():
        table = _Table(output, resume)
        plan = _plan(field, region, rotate, model, option, fields, calibration, points, table.before)
        pictures = pictures_in(folder)
        if not pictures:
            raise BadInput(f"There is no image in {folder}.", "Select a folder with PNG, JPEG, BMP or WebP files.",
                           reason="no-pictures")
        jobs = JobEngine(count, engine=engine)
    order = {path.name: number for number, path in enumerate(pictures)}
    try:
        with jobs:
            _work(jobs, count, plan.requests(pictures), table, order)
    except KeyboardInterrupt:
        say(f"Stopped after {len(table.rows)} of {len(order)} images." + (" Continue with --resume." if output else ""))
        raise typer.Exit(STOPPED) from None
    except TouchlineError:
        say(f"Ended after {len(table.rows)} of {len(order)} images.")
        raise
    rows = table.in_order()
    print(_summary(rows, output))
    if any(row["verdict"] not in ACCEPTED[enough] for row in rows):
        raise typer.Exit(BAD)


def _work(jobs: Any, count: int, requests: Any, table: "_Table", order: dict[str, int]) -> None:
    """Put each row into the table as it comes, which is whole at all times; the bar counts parts of pictures too."""
    with progress_bar("Reading the folder") as bar:
        def watch(under_way: float) -> None:
            done = len(table.rows)
            bar(min((done + under_way) / len(order), 1.0), f"{done} of {len(order)} images")

        try:
            for row in run_requests(jobs, count, requests, watch):
                table.add(order[row["picture"]], row)
                watch(0.0)
        finally:
            table.save()


class _Table:
    """Rows by their place in the folder, and the file that holds those there are. before: of an earlier run."""

    def __init__(self, path: Path | None, resume: bool) -> None:
        self.rows: dict[int, Row] = {}
        self.before: tuple[Row, ...] = ()
        self._path, self._saved_at, self._took_s = path, time.monotonic(), 0.0
        self._suffix = "" if path is None else path.suffix.lower()
        if path is not None and self._suffix not in SUFFIXES:
            raise BadInput(f"The type of the table {path.name} is unknown.",
                           f"Use a name that ends with {', '.join(SUFFIXES)}.", reason="unknown-table-format")
        if path is None and resume:
            raise BadInput("--resume needs the table of the earlier run.", "Give it with -o.", reason="no-table")
        if path is not None and resume and path.exists():
            self.before = tuple(read_table(files.read_bytes(path), self._suffix))

    def add(self, place: int, row: Any) -> None:
        self.rows[place] = row
        # The whole file is written each time: seldom enough that an archive of thousands is not slowed by it.
        if time.monotonic() - self._saved_at > max(SAVE_EVERY_S, 20 * self._took_s):
            self.save()

    def in_order(self) -> list[Any]:
        return [self.rows[place] for place in sorted(self.rows)]

    def save(self) -> None:
        if self._path is not None:
            start = time.monotonic()
            files.write_bytes(self._path, encode_table(self.in_order(), self._suffix))
            self._saved_at = time.monotonic()
            self._took_s = self._saved_at - start


def _plan(field: str | None, region: str | None, rotate: int | None, model: str | None, option: list[str] | None,
            fields: Path | None, calibration: Path | None, points: Path | None, before: Any) -> Any:
    """Return what to do with each picture; raise for an unknown field, region or model before the first."""
    known_fields, options = own_fields(fields), options_from(option)
    if field is not None and region is not None:
        known_fields[field].region(region, rotate)
    elif field is not None:
        known_fields[field]
    if model is not None:
        MODELS[model]

    def task(path: Path, size: Any, sha256: str, clicks: Path) -> Any:
        given = files.read_points_file(clicks)
        request = task_of(path, size, sha256, given, known_fields, field, region, rotate, model, options)
        request.check_names([request.model])
        return request

    known = None if calibration is None else files.read_calibration(calibration)
    return BatchPlan(files.read_bytes, files.read_points_file, task, points, known, before)


@contextmanager
def _wrong_use() -> Iterator[None]:
    """Treat what is refused before the first picture as a wrong command line."""
    try:
        yield
    except TouchlineError as error:
        exit_code_of(error)
        raise typer.Exit(USAGE) from None


def _summary(rows: list[Any], output: Path | None) -> str:
    """Return how many are how good; those that are not good by name; without a file the figures of all."""
    counts = ", ".join(f"{count} {level}" for level, count in count_verdicts(rows).items())
    lines = [f"{len(rows)} images: {counts}."]
    for row in rows:
        if row["verdict"] == "failed":
            lines.append(f"{row['picture']}: {row['problem']} {row['fix']}")
        elif row["verdict"] not in ("good", "fair") or output is None:
            lines.append(f"{row['picture']}: {row['verdict']}, {_mm(row['rms_mm'])} rms, "
                         f"{_mm(row['held_out_mm'])} cross-validated, {_mm(row['worst_mm'])} at most.")
    return "\n".join([*lines, *([f"Saved as {output}."] if output else [])])


def _mm(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2f} mm"
