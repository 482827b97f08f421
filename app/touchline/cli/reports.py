"""report: one calibration as a page to print or keep, with an exit code for scripts."""

import json
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline import report as reporting
from touchline.cli import files
from touchline.cli.console import Enough, EnoughOption, exit_below
from touchline.cli.server import ConfigOption, stored
from touchline.core.errors import Conflict
from touchline.images import frame_from_bytes
from touchline.report.contents import HEAD, outcome, what_is_missing

ID = re.compile(r"[0-9a-f]{16}")

CalibrationOrId = Annotated[str, typer.Argument(metavar="CAL.json|ID", help="A calibration from calibrate or exported "
                                                "as json; or the id of a calibration in the data folder of a server "
                                                "that is not running.")]
PictureFile = Annotated[Path | None, typer.Option("--picture", metavar="IMAGE", help="The calibration image. With an "
                                                  "ID, the saved image is used.")]
OutFile = Annotated[Path | None, typer.Option("--out", "--output", "-o", metavar="REPORT.html", help="The page to "
                                              "write.")]
DataFolder = Annotated[Path | None, typer.Option("--data", metavar="DIR", help="Data folder of the server, for an ID.")]
SceneFile = Annotated[Path, typer.Option("--out", "--output", "-o", metavar="SCENE.html", help="The page to write.")]
Before = Annotated[Path | None, typer.Option("--before", metavar="CAL.json", help="An older version of the same "
                                             "camera, to show the changes.")]
Dark = Annotated[bool, typer.Option("--dark/--light", help="Background of the scene.")]


def report(calibration: CalibrationOrId, picture: PictureFile = None, output: OutFile = None,
           enough: EnoughOption = Enough.fair, data: DataFolder = None, config: ConfigOption = None,
           as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False) -> None:
    """Show or write the report of one calibration. Exit code 0 if it is good enough."""
    known, clicked = calibration_and_picture(calibration, picture, data, config)
    contents = reporting.contents(known, clicked)
    told = json.dumps(contents, allow_nan=False) if as_json else _summary(contents, output)
    if output is not None:
        html = reporting.page(contents, reporting.draw(known, clicked, contents))
        files.write_bytes(output, html.encode("utf-8", "replace"))
    print(told)
    exit_below(enough, contents["verdict"]["level"])


def calibration_and_picture(calibration: str, picture: Path | None, data: Path | None,
                            config: Path | None) -> tuple[Any, Any]:
    """Return the calibration of a file or an id, and the picture that was clicked, if it is given or stored."""
    if ID.fullmatch(calibration) and not Path(calibration).exists():
        known, clicked = _stored(calibration, data, config)
    else:
        known, clicked = files.read_calibration(Path(calibration)), None
    if picture is not None:
        frame = files.read_picture(picture)
        if frame.size != known.image_size:
            raise Conflict(f"{picture} has {frame.size}; the calibration is for {known.image_size}.",
                           "Use the calibration image.", reason="size-mismatch")
        clicked = reporting.ReportPicture(frame)
    return known, clicked or reporting.ReportPicture(None, "No image was given.")


def _stored(id: str, data: Path | None, config: Path | None) -> tuple[Any, Any]:
    with stored(data, config) as (store, _):
        calibration = store.calibrations.get(id)
        return calibration, reporting.report_picture(
            calibration, lambda snapshot: frame_from_bytes(store.snapshots.picture(snapshot)))


def _summary(contents: dict[str, Any], output: Path | None) -> str:
    lines = [f"{contents['verdict']['level']}: {contents['verdict']['sentence']}"]
    lines += [f"{it['title']}: {it['value']:.{HEAD[key].digits}f} {it['unit']}".rstrip()
              for key, it in contents["figures"].items() if it["value"] is not None]
    lines += what_is_missing(contents["figures"])
    lines += [" ".join(filter(None, (f"{outcome(claim)}: {claim['title']}.",
                                     claim["evidence"], claim["fix"])))
              for claim in contents["claims"] if claim["state"] != "held"]
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in contents["warnings"]]
    if contents["picture"]["same"] is False:
        lines.append("Warning: This is not the calibration image: its sha256 differs.")
    return "\n".join([*lines, *([f"Saved as {output}."] if output else [])])
