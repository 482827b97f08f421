"""check: whether yesterday's calibration still holds in today's picture."""

import json
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from touchline.cli import files
from touchline.cli.console import Enough, EnoughOption, exit_below
from touchline.cli.progress import progress_bar
from touchline.cli.requests import AsJson
from touchline.core.geometry import Pixels
from touchline.core.jobs import subprogress
from touchline.core.sentences import marking_names
from touchline.drift.check import Check
from touchline.drift.check import check as check_calibration
from touchline.evaluate.verdict import level_of
from touchline.workflows.job_pictures import median_frame

GOOD_COLOUR, POOR_COLOUR, EXPECTED_COLOUR = (80, 220, 80), (60, 60, 255), (255, 255, 255)  # BGR


def check(
    calibration: Annotated[
        Path,
        typer.Argument(
            metavar="CAL.json", help="A calibration from calibrate, or exported as json."
        ),
    ],
    pictures: Annotated[
        list[Path],
        typer.Argument(
            metavar="PICTURES…",
            help="Current images of the camera. Moving "
            "objects are removed if there are several images.",
        ),
    ],
    drawn: Annotated[
        Path | None,
        typer.Option(
            "--drawn",
            metavar="PICTURE",
            help="Write the image with the expected and the detected lines.",
        ),
    ] = None,
    enough: EnoughOption = Enough.fair,
    as_json: AsJson = False,
) -> None:
    """Compare the field lines with a calibration. Exit code 5 if it is below --enough."""
    calibrated = files.read_calibration(calibration)
    with progress_bar("Checking the calibration") as progress, files.decoded(pictures) as reads:
        frame = median_frame(reads, subprogress(progress, 0.0, 0.4))
        found = check_calibration(calibrated, frame.pixels, subprogress(progress, 0.4, 1.0))
    summary = json.dumps(found, allow_nan=False) if as_json else _summary(found)
    if drawn is not None:
        files.write_picture(drawn, _draw(frame.pixels, found))
    print(summary)
    exit_below(enough, found["verdict"]["level"])


def _summary(found: Check) -> str:
    verdict = found["verdict"]
    rows = [f"{verdict['sentence']} {verdict['fix']}".strip()]
    names = marking_names([line["feature"] for line in found["lines"]])
    width = max(map(len, names), default=4)
    rows.append(f"{'line':<{width}}  detected      mm  largest mm    px")
    for name, line in zip(names, found["lines"], strict=True):
        figures = (
            "     –           –     –"
            if line["rms_mm"] is None
            else (f"{line['rms_mm']:6.1f}    {line['worst_mm']:8.1f}  {line['rms_px']:4.1f}")
        )
        rows.append(f"{name:<{width}}     {100 * line['found_share']:3.0f} %  {figures}")
    if found["carpet"] is not None:
        x, y = found["carpet"]["where"]
        rows.append(
            f"Largest error on the carpet: {found['carpet']['max_mm']:.1f} mm at ({x:.0f}, {y:.0f}) mm."
            + (f" At robot-top height: {found['hat']['max_mm']:.1f} mm." if found["hat"] else "")
        )
    return "\n".join(rows)


def _draw(pixels: Pixels, found: Check) -> Pixels:
    """Draw white points where the calibration has the lines, green or red ones where they are."""
    canvas = pixels.copy()
    for point in found["points"]:
        expected, actual = (
            tuple(np.round(px).astype(int).tolist()) for px in (point["expected"], point["found"])
        )
        cv2.circle(canvas, expected, 2, EXPECTED_COLOUR, -1, cv2.LINE_AA)
        colour = POOR_COLOUR if level_of(abs(point["off_mm"])) == "poor" else GOOD_COLOUR
        cv2.line(canvas, expected, actual, colour, 1, cv2.LINE_AA)
        cv2.circle(canvas, actual, 2, colour, -1, cv2.LINE_AA)
    return canvas
