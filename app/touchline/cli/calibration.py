"""calibrate, correct and transform: files in, files or lines out."""

import json
import math
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli import files, requests
from touchline.cli.progress import progress_bar
from touchline.evaluate.headline_figures import HEADLINE, headline_figures, what_is_missing
from touchline.evaluate.report_types import FitReport
from touchline.imaging.correction import CorrectedView
from touchline.models import model_of
from touchline.workflows import calibration as workflow

CalibrationFile = Annotated[
    Path,
    typer.Option(
        "--calibration",
        "-c",
        metavar="CAL.json",
        help="A calibration from calibrate, or exported as json.",
    ),
]
SHOWN = (
    "rms_px",
    "max_px",
    "rms_mm",
    "max_mm",
    "cv_rms_mm",
    "distortion_before_pct",
    "distortion_after_pct",
)


class Coordinates(StrEnum):
    """What a point's numbers mean."""

    image = "image"
    corrected = "corrected"
    field = "field"


def calibrate(
    image: requests.ImageFile,
    points: requests.PointsFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="CAL.json", help="The calibration to write.")
    ],
    field: requests.FieldName = None,
    region: requests.RegionName = None,
    rotate: requests.Rotate = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            help="Camera model, or auto for the recommended model. By default polynomial.",
        ),
    ] = None,
    option: requests.Options = None,
    lens: requests.LensFile = None,
    lens_sigma: requests.LensSigma = None,
    height_mm: requests.HeightMm = None,
    height_sigma_mm: requests.HeightSigmaMm = None,
    note: Annotated[str, typer.Option("--note", help="Saved with the calibration.")] = "",
    fields: requests.OwnFields = None,
    as_json: requests.ReportAsJson = False,
) -> None:
    """Calibrate one image from points."""
    options = requests.options_from(option, lens, lens_sigma, height_mm, height_sigma_mm)
    task = requests.task_from(image, points, field, region, rotate, model, options, note, fields)
    with progress_bar("Calibrating") as progress:
        done = task.run(progress)
    text = json.dumps(done.report, allow_nan=False) if as_json else _summary(done.report, output)
    files.write_calibration(output, task.record(done))
    print(text)


def correct(
    image: Annotated[
        Path, typer.Argument(metavar="IMAGE", help="An image with the size of the calibration.")
    ],
    calibration: CalibrationFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="OUT.png", help="The result, PNG or JPEG.")
    ],
    margin: Annotated[
        int, typer.Option("--margin", min=0, max=2000, help="Carpet shown around the region, px.")
    ] = 0,
    width: Annotated[
        int | None, typer.Option("--width", min=16, max=8192, help="Width of the result, px.")
    ] = None,
) -> None:
    """Correct one image."""
    known = files.read_calibration(calibration)
    with progress_bar("Correcting") as progress:
        frame = files.read_picture(image)
        progress(0.3, "Correcting")
        corrected = workflow.correct(
            frame.pixels, model_of(known), known.image_size, CorrectedView(margin, width)
        )
        progress(0.8, "Writing")
        files.write_picture(output, corrected)


def transform(
    calibration: CalibrationFile,
    source: Annotated[Coordinates, typer.Option("--from", help="Source frame of the points.")],
    target: Annotated[Coordinates, typer.Option("--to", help="Target frame of the points.")],
    points: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[X,Y]...",
            help="Points. Without points, JSON or lines of x,y are read from standard input.",
        ),
    ] = None,
    z_mm: Annotated[float, typer.Option("--z", help="Height above the carpet, mm.")] = 0.0,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print JSON, with null for a point that cannot be converted."),
    ] = False,
) -> None:
    """Convert pixels to field millimetres, or back."""
    known = files.read_calibration(calibration)
    given = (
        files.points_from_pairs(points)
        if points
        else files.points_from_text(sys.stdin.read(files.MAX_POINT_BYTES))
    )
    found = workflow.transform(model_of(known), given, source.value, target.value, z_mm).tolist()
    reached = [point if math.isfinite(point[0]) else None for point in found]
    if as_json:
        print(json.dumps({"points": reached}, allow_nan=False))
    else:
        print("\n".join(f"{p[0]!r},{p[1]!r}" if p else "nan,nan" for p in reached))


def _summary(report: FitReport, output: Path) -> str:
    known = headline_figures(report)

    def figure(key: str, sign: str = "") -> str:
        value, it = known[key]["value"], HEADLINE[key]
        return "unknown" if value is None else f"{value:{sign}.{it.digits}f} {it.unit}"

    kind = report["distortion"]["kind"]
    lines = [
        report["verdict"]["sentence"],
        f"Residuals {figure('rms_px')} rms, {figure('max_px')} at most; {figure('rms_mm')} rms, "
        f"{figure('max_mm')} at most; cross-validated {figure('cv_rms_mm')}.",
        f"Distortion {figure('distortion_before_pct', '+')} before, {figure('distortion_after_pct', '+')} after"
        f"{'' if kind is None else f' ({kind})'}.",
    ]
    lines += what_is_missing(known, SHOWN)
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in report["warnings"]]
    return "\n".join([*lines, f"Saved as {output}."])
