"""scene: where cameras hang, what they see and where they err, as one page in 3-D that needs no server."""

import io
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import typer

from app.cli import files
from app.cli.reports import CalibrationOrId, DataFolder, PictureFile, calibration_and_picture
from app.cli.stored import ConfigOption
from app.scene.cameras import shrink
from app.scene.export import scene_html

OutFile = Annotated[Path, typer.Option("--out", "--output", "-o", metavar="SCENE.html", help="The page to write.")]
Before = Annotated[Path | None, typer.Option("--before", metavar="CAL.json", help="An older version of the same "
                                             "camera, to show the changes.")]
Dark = Annotated[bool, typer.Option("--dark/--light", help="Background of the scene.")]


def scene(calibration: CalibrationOrId, output: OutFile, picture: PictureFile = None, before: Before = None,
          dark: Dark = False, data: DataFolder = None, config: ConfigOption = None) -> None:
    """Write the 3-D scene of one calibration as an HTML page."""
    known, clicked = calibration_and_picture(calibration, picture, data, config)
    older = files.read_calibration(before) if before is not None else None
    name = clicked.camera_name or known.camera or known.field["name"]
    given = {"cameras": [{"key": known.id or "camera", "title": name, "calibration": known.to_json(),
                          "before": older.to_json() if older is not None else None}]}
    pictures = {known.id or "camera": shrink(clicked.frame.pixels)} if clicked.frame is not None else {}
    with redirect_stdout(io.StringIO()):  # viser says where it listens; it is for nobody
        html = scene_html(given, pictures, dark=dark, title=f"Scene of {name}, version {known.version}")
    files.write_bytes(output, html.encode("utf-8", "replace"))
    print(f"Saved as {output}.")
