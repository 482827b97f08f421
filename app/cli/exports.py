"""export and import: a calibration to the files of other programs and from them."""

from pathlib import Path
from typing import Annotated

import typer

from app.cli import files
from app.cli.requests import OwnFields, RegionName, Rotate, own_fields
from app.core.records import Calibration
from app.workflows import interchange
from app.workflows.calibration_request import with_new_id

CameraId = Annotated[int | None, typer.Option("--camera-id", min=0, max=2**32 - 1, help="The camera's number in a "
                                              "packet of the Small Size League.")]


def export(
    calibration: Annotated[Path, typer.Argument(metavar="CAL.json", help="As calibrate wrote it.")],
    format: Annotated[str | None, typer.Option("--format", "-f", help="opencv, ros, kalibr, mrcal, photonvision, "
                                               "ssl-vision, npz, csv or json; without one they are listed with what "
                                               "each costs.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="The file to write.")] = None,
    approximate: Annotated[bool, typer.Option("--approximate", help="The nearest that the format can hold; its error "
                                              "in mm is told.")] = False,
    camera_id: CameraId = None,
) -> None:
    """Write a calibration as another program's file."""
    known = files.read_calibration(calibration)
    if format is None:
        for row in interchange.formats(known):
            print(f"{row['format']:13} {_cost(row)}. {row['holds']}")
        return
    if output is None:
        raise typer.BadParameter("there is no file to write", param_hint="--output")
    exported = interchange.export(known, format, approximate, camera_id)
    files.write_bytes(output, exported.data)
    print(f"Written to {output}{'' if exported.loss is None else f', {_error(exported.loss.to_json())}'}.")


def import_file(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Of any format that export writes, but npz.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="CAL.json|LENS.json", help="The calibration to "
                                         "write, or the lens where the file has no more.")],
    field: Annotated[str | None, typer.Option("--field", help="Over which field the camera hangs, where the file does "
                                              "not say.")] = None,
    region: RegionName = None, rotate: Rotate = None,
    image_size: Annotated[str | None, typer.Option("--image-size", metavar="WxH", help="The pictures' size, where the "
                                                   "file does not say; where it does, it is scaled.")] = None,
    camera_id: CameraId = None,
    model: Annotated[str | None, typer.Option("--model", help="To fit to a table of points.")] = None,
    fields: OwnFields = None,
) -> None:
    """Read another program's file."""
    size = None if image_size is None else interchange.size_from_text(image_size)
    options = interchange.ImportOptions(field, region, rotate, size, None, camera_id, model)
    found = interchange.read_file(files.read_bytes(file, files.MAX_JSON_BYTES), file.name, camera_id)
    if interchange.is_lens(found):
        files.write_lens(output, interchange.lens_record_from_file(found, options))
        print(f"A lens, written to {output}: hold it with --lens; the field then tells where the camera hangs.")
        return
    if not isinstance(found, Calibration):
        found = with_new_id(interchange.calibration_from_file(found, options, own_fields(fields)))
    files.write_calibration(output, found)
    print(f"A calibration ({found.model_name}, {found.image_size}, {found.field['name']} {found.region}), written to "
          f"{output}.")


def _cost(row: dict) -> str:
    if row["problem"] is not None:
        return f"cannot: {row['problem']['what'].rstrip('.')}"
    if row["loss"] is None:
        return "exact"
    return _error(row["loss"]) + ("" if row["exact"] else ", with --approximate")


def _error(loss: dict) -> str:
    words = f"at worst {loss['worst_mm']:.3f} mm off on the carpet"
    if loss["hat_worst_mm"] is None:
        return words
    return f"{words}, {loss['hat_worst_mm']:.3f} mm {loss['hat_height_mm']:g} mm above it"
