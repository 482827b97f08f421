"""export, import and turn: a calibration to the files of other programs and from them, and with turned images."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli import files
from touchline.cli.requests import OwnFields, RegionName, Rotate, own_fields
from touchline.core.errors import TouchlineError
from touchline.core.quarter_turn import check_turn, turn_in_words
from touchline.core.records import Calibration
from touchline.core.sentences import area_name
from touchline.formats.document import MAX_FILE_BYTES
from touchline.workflows import interchange
from touchline.workflows.calibration_request import with_new_id
from touchline.workflows.turning import turned_calibration, turned_lens_record

# what a fix says to programs, and the names in it that are options here
TO_PROGRAMS = re.compile(r"From a program, (send|omit) (.*)")
OPTION_NAMES = re.compile(
    rf"\b({'|'.join(option.name for option in fields_of(interchange.ImportOptions))})\b"
)

CameraId = Annotated[
    int | None,
    typer.Option(
        "--camera-id",
        min=0,
        max=2**32 - 1,
        help="The camera's number in a packet of the Small Size League.",
    ),
]


def export(
    calibration: Annotated[
        Path, typer.Argument(metavar="CAL.json", help="A calibration from calibrate.")
    ],
    format: Annotated[
        str | None,
        typer.Option(
            "--format",
            "-f",
            help="opencv, ros, kalibr, mrcal, photonvision, "
            "ssl-vision, vision-processor, vision-processor-start, npz, csv or json. Without a format, all formats are "
            "listed with their errors.",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="The file to write.")
    ] = None,
    approximate: Annotated[
        bool,
        typer.Option(
            "--approximate",
            help="Write the best approximation in the format and state its error in mm.",
        ),
    ] = False,
    camera_id: CameraId = None,
) -> None:
    """Write a calibration in the format of another program."""
    known = files.read_calibration(calibration)
    if format is None:
        for row in interchange.formats(known):
            print(f"{row['format']:13} {_cost(row)}. {row['holds']}")
        return
    if output is None:
        raise typer.BadParameter("there is no file to write", param_hint="--output")
    exported = interchange.export(known, format, approximate, camera_id)
    files.write_bytes(output, exported.data)
    print(
        f"Saved as {output}{'' if exported.loss is None else f', {_error(exported.loss.to_json())}'}."
    )


def import_file(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A file in a format of export, or of another program."),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="CAL.json|LENS.json",
            help="The calibration to write, or the lens if the file contains only a lens.",
        ),
    ],
    field: Annotated[
        str | None, typer.Option("--field", help="Field of the camera, if it is not in the file.")
    ] = None,
    region: RegionName = None,
    rotate: Rotate = None,
    image_size: Annotated[
        str | None,
        typer.Option(
            "--image-size",
            metavar="WxH",
            help="Image size, if it is not in the file. If it is, the calibration is scaled.",
        ),
    ] = None,
    camera_id: CameraId = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            help="Camera model for a table of points, or the lens if it is not in the file.",
        ),
    ] = None,
    entry: Annotated[
        str | None, typer.Option("--entry", help="The camera of a file with several, by its name.")
    ] = None,
    turn: Annotated[
        int,
        typer.Option(
            "--turn",
            help="By how much images of the camera were turned clockwise since: 90, 180 or 270.",
        ),
    ] = 0,
    fields: OwnFields = None,
) -> None:
    """Read a file of another program."""
    with _fixes_with_options():
        size = None if image_size is None else interchange.size_from_text(image_size)
        options = interchange.ImportOptions(
            field, region, rotate, size, None, camera_id, model, entry, check_turn(turn)
        )
        found = interchange.read_file(files.read_bytes(file, MAX_FILE_BYTES), options)
        if interchange.is_lens(found):
            files.write_lens(output, interchange.lens_record_from_file(found, options))
            print(f"Lens saved as {output}. Use it with calibrate --lens to fit the camera pose.")
            return
        if isinstance(found, Calibration):
            found = interchange.turned_as_stated(found, options)
        else:
            found = with_new_id(
                interchange.calibration_from_file(found, options, own_fields(fields))
            )
        files.write_calibration(output, found)
        print(
            f"Calibration ({found.model_name}, {found.image_size}, {found.field['name']}, {area_name(found.region)}), "
            f"saved as {output}."
        )


@contextmanager
def _fixes_with_options() -> Iterator[None]:
    """Let what a fix says to programs name the options of the shell: "send it as image_size", --image-size."""
    try:
        yield
    except TouchlineError as refused:
        refused.fix = TO_PROGRAMS.sub(
            lambda found: (
                f"{'Give' if found[1] == 'send' else 'Omit'} {OPTION_NAMES.sub(_option, found[2])}"
            ),
            refused.fix,
        )
        raise


def _option(name: re.Match[str]) -> str:
    return f"--{name[0].replace('_', '-')}"


def turn(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="CAL.json|LENS.json", help="A calibration from calibrate, or a lens from board."
        ),
    ],
    turn_deg: Annotated[
        int,
        typer.Option(
            "--turn",
            min=90,
            max=270,
            help="By how much the images are turned clockwise: 90, 180 or 270.",
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="NEW.json", help="The file to write.")
    ],
) -> None:
    """Turn a calibration or a lens with the images of its camera."""
    words = turn_in_words(check_turn(turn_deg))
    lens = files.read_lens_record(file)
    if lens is not None:
        files.write_lens(output, turned_lens_record(lens, turn_deg))
        print(f"Lens {words}, saved as {output}.")
        return
    known = files.read_calibration(file)
    made = turned_calibration(known, turn_deg, f"Version {known.version}, {words}.")
    files.write_calibration(output, with_new_id(made))
    print(f"Calibration {words}, saved as {output}. Images must be {made.image_size}.")


def _cost(row: dict) -> str:
    if row["problem"] is not None:
        return f"not possible: {row['problem']['what'].rstrip('.')}"
    if row["loss"] is None:
        return "exact"
    return _error(row["loss"]) + ("" if row["exact"] else ", with --approximate")


def _error(loss: dict) -> str:
    words = f"largest error {loss['worst_mm']:.3f} mm on the carpet"
    if loss["hat_worst_mm"] is None:
        return words
    return f"{words}, {loss['hat_worst_mm']:.3f} mm {loss['hat_height_mm']:g} mm above it"
