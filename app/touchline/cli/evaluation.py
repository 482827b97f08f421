"""compare, difference and uncertainty: which model, how far two calibrations are apart, how far to trust one."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from touchline.cli import files, requests
from touchline.cli.progress import progress_bar
from touchline.evaluate.fit.difference import Difference
from touchline.models.restored import Restored, model_of
from touchline.workflows import calibration as workflow

PngFile = Annotated[Path | None, typer.Option("--png", metavar="OUT.png", help="Draw a map with a scale in mm.")]


def compare(
    image: requests.ImageFile, points: requests.PointsFile,
    field: requests.FieldName = None, region: requests.RegionName = None, rotate: requests.Rotate = None,
    models: Annotated[str | None, typer.Option("--models", metavar="NAME,…", help="Camera models, separated by "
                                               "commas. By default all.")] = None,
    option: requests.Options = None, lens: requests.LensFile = None, lens_sigma: requests.LensSigma = None,
    height_mm: requests.HeightMm = None, height_sigma_mm: requests.HeightSigmaMm = None,
    fields: requests.OwnFields = None, as_json: requests.AsJson = False,
) -> None:
    """Fit every camera model to the same points and recommend one."""
    options = requests.options_from(option, lens, lens_sigma, height_mm, height_sigma_mm)
    task = requests.task_from(image, points, field, region, rotate, None, options, "", fields)
    names = [name.strip() for name in models.split(",")] if models else None
    with progress_bar("Comparing") as progress:
        found = task.compare(names, progress)
    if as_json:
        print(json.dumps(found, allow_nan=False))
    else:
        _show_ranking(found)


def difference(one: Annotated[Path, typer.Argument(metavar="A.json", help="A calibration.")],
               other: Annotated[Path, typer.Argument(metavar="B.json",
                                                     help="Another calibration for the same image size.")],
               png: PngFile = None, as_json: requests.AsJson = False) -> None:
    """Difference of two calibrations over the region, in mm on the carpet and in px in the image."""
    a, b = files.read_calibration(one), files.read_calibration(other)
    model, _, region = Restored.of(a)
    found = workflow.difference(model, model_of(b), region)
    told = json.dumps(found, allow_nan=False) if as_json else _difference(found)
    if png is not None:
        values = workflow.difference_grid(found)["mm"]
        files.write_picture(png, workflow.error_map_image(values, region, f"{other.stem} from {one.stem}"))
    print(told)


def uncertainty(
    calibration: Annotated[Path, typer.Argument(metavar="CAL.json", help="A calibration from calibrate.")],
    z_mm: Annotated[float, typer.Option("--z", min=0, max=5000, help="Height of the plane above the carpet, mm.")] = 0,
    png: PngFile = None, as_json: requests.AsJson = False,
) -> None:
    """Expected error over the region, in the plane at a height: the effect of the noise of the points."""
    known = files.read_calibration(calibration)
    model, _, region = Restored.of(known)
    found = workflow.uncertainty(model, known.covariance, region, z_mm)
    if png is not None:
        title = f"expected error at z = {z_mm:g} mm"
        files.write_picture(png, workflow.error_map_image(found["grid"]["sigma_mm"], region, title))
    if as_json:
        print(json.dumps(found, allow_nan=False))
    else:
        x, y = found["worst_place"]
        print(f"At z = {z_mm:g} mm the expected error is {found['rms']:.2f} mm rms over the region, "
              f"median {found['median']:.2f} mm, {found['max']:.2f} mm at most, at ({x:.0f}, {y:.0f}) mm.")


def _difference(found: Difference) -> str:
    if found["worst_place"] is None:
        return "The two calibrations have no part of the region in common."
    x, y = found["worst_place"]
    in_image = "unknown, because the second calibration does not cover it" if found["max_px"] is None else (
        f"{found['rms_px']:.2f} px rms, {found['max_px']:.2f} px at most")
    return (f"{found['rms_mm']:.2f} mm rms over the region, median {found['median_mm']:.2f} mm, "
            f"{found['max_mm']:.2f} mm at most, at ({x:.0f}, {y:.0f}) mm.\nIn the image {in_image}.")


def _show_ranking(found: dict[str, Any]) -> None:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    table.add_column("")
    table.add_column("model", no_wrap=True)
    for title in ("field mm", "cross-val mm", "tops mm", "rms px", "params"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("verdict")
    for row in found["ranking"]:
        table.add_row("→" if row["model"] == found["recommended"] else "", row["model"], _number(row["field_mm"]),
                      _number(row["held_out_mm"]), _number(row["expected_hat_mm"]), _number(row["rms_px"]),
                      str(row["parameters"]), row["verdict"]["level"])
    console = Console(highlight=False)
    console.print(table, end="")
    print(found["reason"])
    for failed in found["failed"]:
        print(f"{failed['title']} cannot be fitted: {failed['what']} {failed['fix']}")


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
