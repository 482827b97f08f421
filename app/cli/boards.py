"""board: pictures of a calibration board in, a lens out."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli import files
from app.cli.progress import progress_bar
from app.cli.requests import ReportAsJson, options_from
from app.core.board import Board
from app.workflows.board_request import BoardCalibrationRequest


def board(
    pictures: Annotated[list[Path], typer.Argument(metavar="PICTURES…", help="About twenty, of one size.")],
    columns: Annotated[int, typer.Option("--columns", help="Inner corners along a row.")],
    rows: Annotated[int, typer.Option("--rows", help="Inner corners along a column.")],
    square_mm: Annotated[float, typer.Option("--square-mm", help="Side of a square.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="LENS.json", help="The lens to write.")],
    kind: Annotated[str, typer.Option("--kind", help="chessboard or charuco.")] = "chessboard",
    marker_mm: Annotated[float | None, typer.Option("--marker-mm", help="Side of a charuco board's marker.")] = None,
    dictionary: Annotated[str | None, typer.Option("--dictionary", help="Its markers, such as DICT_4X4_50.")] = None,
    legacy: Annotated[bool, typer.Option("--legacy", help="Printed by OpenCV before 4.6.")] = False,
    model: Annotated[str, typer.Option("--model", help="brown-conrady, or fisheye for very wide lenses.")] =
    "brown-conrady",
    option: Annotated[list[str] | None, typer.Option("--option", metavar="NAME=VALUE", help="A setting of the fit, "
                                                     "such as warp=false; may be repeated.")] = None,
    as_json: ReportAsJson = False,
) -> None:
    """Find a lens from pictures of a board; calibrate --lens then holds it."""
    markers = {"marker_mm": marker_mm, "dictionary": dictionary, "legacy": legacy}
    known = Board.from_json({"kind": kind, "columns": columns, "rows": rows, "square_mm": square_mm,
                             **{name: value for name, value in markers.items() if value}})
    task = BoardCalibrationRequest(known, model, options_from(option))
    with progress_bar("Looking for the board") as progress, files.decoded(pictures) as reads:
        found = task.from_pictures(reads, progress)
    files.write_lens(output, found)
    print(json.dumps(found["report"], allow_nan=False) if as_json else _summary(found, output))


def _summary(found: dict[str, Any], output: Path) -> str:
    report, lens = found["report"], found["lens"]
    used = sum(view["used"] for view in report["views"])
    lines = [report["verdict"]["sentence"],
             f"{used} of {len(report['views'])} views, {report['corners']} corners, residuals "
             f"{report['rms_px']:.3f} px rms; {report['coverage']['share']:.0%} of the picture covered.",
             f"Focal length {lens['focal_px']:.2f} px, principal point ({lens['centre_px'][0]:.2f}, "
             f"{lens['centre_px'][1]:.2f}) px, terms {' '.join(report['terms']['chosen']) or 'none'}."]
    lines += [f"  {name} {number['value']:.6g}" + ("" if number["sigma"] is None else f" ± {number['sigma']:.2g}")
              for name, number in report["parameters"].items() if name in (*report["terms"]["chosen"], "aspect")]
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in report["warnings"]]
    return "\n".join([*lines, f"Written to {output}."])
