"""straight: how far a camera's lens bows straight edges, from pictures or from lines clicked in one."""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli import files
from app.cli.progress import progress_bar
from app.cli.requests import ReportAsJson
from app.core.geometry import ImageSize
from app.models.distortion import Distortion
from app.workflows.straight_lines import undistort
from app.workflows.straight_lines_request import StraightLinesRequest


def straight(
    pictures: Annotated[list[Path] | None, typer.Argument(metavar="[PICTURES…]", help="Images of one camera at one "
                                                          "resolution. Edges are detected in each.")] = None,
    lines: Annotated[Path | None, typer.Option("--lines", metavar="LINES.json",
                                               help='Marked lines: {"lines": [[[x, y], …], '
                                               '…], "image_size": [w, h]}, raw px of the first image.')] = None,
    lens: Annotated[str, typer.Option("--lens", help="auto, division, division-even or brown-conrady.")] = "auto",
    centre_sigma_px: Annotated[float | None, typer.Option("--centre-sigma-px", help="Uncertainty of the lens centre "
                               "around the image centre; 0: fixed. By default 1 % of the diagonal.")] = None,
    corrected: Annotated[Path | None, typer.Option("--corrected", metavar="PICTURE", help="Write the first image "
                                                   "without distortion.")] = None,
    as_json: ReportAsJson = False,
) -> None:
    """Measure how straight the edges in images are, and fit the lens that straightens them."""
    pictures = pictures or []
    if corrected is not None and not pictures:
        raise typer.BadParameter("--corrected requires an image.")
    given: dict[str, Any] = files.read_lines(lines) if lines is not None else {"lines": []}
    size = given.get("image_size")
    task = StraightLinesRequest(lens, centre_sigma_px, tuple(given["lines"]),
                                None if size is None else ImageSize.of(size))
    with progress_bar("Detecting edges") as progress, files.decoded(pictures) as reads:
        found = task.answer(reads, progress)
        if corrected is not None:
            _, read_first = reads[0]
            files.write_picture(corrected, undistort(read_first().pixels, Distortion.from_json(found["lens"])))
    print(json.dumps(found, allow_nan=False) if as_json else _summary(found))


def _summary(found: dict[str, Any]) -> str:
    bow, px, lens, sigma = found["bow"]["most"], found["straightness_px"], found["lens"], found["sigma"]
    left = Counter(line["reason"].replace("-", " ") for line in found["lines"] if not line["used"])
    lines = [f"Distortion {found['distortion']}. {found['sentence']}",
             f"Bow {_number(bow['px'])} ± {_number(bow['sigma_px'])} px, {_number(bow['pct'])} % of an edge of "
             f"{bow['length_px']:.0f} px.",
             f"Straightness {px['before']:.2f} px before, {px['after']:.3f} px after, {found['lines_used']} of "
             f"{len(found['lines'])} edges, {found['objects']} objects.",
             f"Lens {lens['name']} about ({lens['centre_px'][0]:.1f}, {lens['centre_px'][1]:.1f}) px, terms per half "
             f"diagonal ({lens['unit_px']:.1f} px):"]
    lines += [f"  {name} {value:.5f}" + (f" ± {sigma[name]:.5f}" if name in sigma else "")
              for name, value in lens["terms"].items() if value or name in sigma]
    lines += [f"Excluded: {', '.join(f'{count} {reason}' for reason, count in left.most_common())}."] if left else []
    return "\n".join([*lines, found["cannot_see"]])


def _number(value: float | None) -> str:
    return "?" if value is None else f"{value:.2f}"
