"""turn: a calibration or a lens for pictures that are turned by quarters."""

from pathlib import Path
from typing import Annotated

import typer

from touchline.cli import files
from touchline.core.quarter_turn import check_turn, turn_in_words
from touchline.workflows.calibration_request import with_new_id
from touchline.workflows.turning import turned_calibration, turned_lens_record


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
