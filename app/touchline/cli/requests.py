"""Options that several commands share, and the fit that a picture, a file of points and these options ask for."""

from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli import files
from touchline.core.errors import BadInput, Conflict
from touchline.core.geometry import ImageSize
from touchline.core.records import observations_from_json
from touchline.settings import Settings
from touchline.store.fields import FieldRepository
from touchline.workflows.calibration_request import CalibrationRequest

ImageFile = Annotated[Path, typer.Argument(metavar="IMAGE", help="PNG, JPEG, BMP or WebP.")]
PointsFile = Annotated[
    Path,
    typer.Option(
        "--points",
        metavar="FILE.json",
        help="Observations: a list, or an object with observations, field and region.",
    ),
]
FieldName = Annotated[str | None, typer.Option("--field", help="Field name, such as ssl-2008.")]
RegionName = Annotated[str | None, typer.Option("--region", help="Covered area of the field.")]
Rotate = Annotated[
    int | None, typer.Option("--rotate", help="Rotation of the region: 0, 90, 180 or 270.")
]
Options = Annotated[
    list[str] | None,
    typer.Option(
        "--option",
        metavar="NAME=VALUE",
        help="Option of the fit, such as degree=3. May be repeated.",
    ),
]
OwnFields = Annotated[
    Path | None, typer.Option("--fields", metavar="DIR", help="Folder with your own fields.")
]
LensFile = Annotated[
    Path | None,
    typer.Option(
        "--lens",
        metavar="LENS.json|CAL.json",
        help="Use the lens of a file from board or calibrate. The field then gives the pose.",
    ),
]
LensSigma = Annotated[
    str | None,
    typer.Option(
        "--lens-sigma",
        metavar="0|own",
        help="Uncertainty of that lens. 0: fixed; own: as measured with the board.",
    ),
]
HeightMm = Annotated[
    float | None, typer.Option("--height-mm", help="Measured camera height above the carpet.")
]
HeightSigmaMm = Annotated[
    float | None,
    typer.Option("--height-sigma-mm", help="Uncertainty of the camera height. By default 30."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print everything as JSON.")]
ReportAsJson = Annotated[bool, typer.Option("--json", help="Print the whole report as JSON.")]
TAPE_SIGMA_MM = 30.0


def task_from(
    image: Path,
    points: Path,
    field: str | None,
    region: str | None,
    rotate: int | None,
    model: str | None,
    options: dict[str, Any],
    note: str,
    fields: Path | None,
) -> Any:
    """Return the request; options of the command line win over the file of points."""
    given = files.read_points_file(points)
    frame = files.read_picture(image)
    return task_of(
        image,
        frame.size,
        frame.sha256,
        given,
        own_fields(fields),
        field,
        region,
        rotate,
        model,
        options,
        note,
    )


def own_fields(folder: Path | None) -> Any:
    """Return all fields: the shipped ones and those of a folder, or of the settings' folder."""
    return FieldRepository(folder or Settings().own_fields)


def task_of(
    image: Path,
    size: Any,
    sha256: str,
    given: dict[str, Any],
    fields: Any,
    field: str | None,
    region: str | None,
    rotate: int | None,
    model: str | None,
    options: dict[str, Any],
    note: str = "",
) -> Any:
    """Return the request for a picture whose size and hash are known. given: what a file of points says."""
    field_name, region_name = field or given.get("field"), region or given.get("region")
    if field_name is None or region_name is None:
        raise BadInput(
            "The field or the region is missing.",
            "Use --field and --region, or state them in the points file.",
            reason="no-field",
        )
    known = fields[field_name]
    turn = rotate if rotate is not None else given.get("rotate")
    if "image_size" in given and ImageSize.of(given["image_size"]) != size:
        raise Conflict(
            f"{image} has {size}; the points are for an image of {given['image_size']}.",
            "Use the image that the points are from.",
            reason="size-mismatch",
        )
    return CalibrationRequest(
        observations_from_json(given["observations"]),
        known,
        known.region(region_name, turn),
        size,
        model or given.get("model") or "polynomial",
        {**(given.get("options") or {}), **options},
        image_sha256=sha256,
        note=note or given.get("note", ""),
    )


def corners_from(text: str) -> list[list[float]]:
    """Return the pixels of "X,Y X,Y …"."""
    try:
        return [[float(number) for number in pair.split(",")] for pair in text.split()]
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is not X,Y X,Y X,Y X,Y", param_hint="--corners"
        ) from None


def options_from(
    words: list[str] | None,
    lens: Path | None = None,
    lens_sigma: str | None = None,
    height_mm: float | None = None,
    height_sigma_mm: float | None = None,
) -> dict[str, Any]:
    """Return a fit's options: NAME=VALUE words (a value is JSON, or else text), a known lens, a height by tape."""
    options: dict[str, Any] = {}
    for word in words or []:
        name, equals, value = word.partition("=")
        if not equals:
            raise typer.BadParameter(f"{word!r} is not NAME=VALUE", param_hint="--option")
        options[name] = files.json_or_text(value)
    if lens is not None:
        options["lens"] = files.read_lens_option(lens)
    if lens_sigma is not None:
        if lens is None:
            raise typer.BadParameter("it requires --lens", param_hint="--lens-sigma")
        options["lens_sigma"] = lens_sigma
    if height_mm is not None:
        options["height_mm"] = {"value": height_mm, "sigma": height_sigma_mm or TAPE_SIGMA_MM}
    elif height_sigma_mm is not None:
        raise typer.BadParameter("it requires --height-mm", param_hint="--height-sigma-mm")
    return options
