"""report: one calibration as a page to print or keep, with an exit code for scripts."""

import json
import re
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli import files
from touchline.cli.archive import ConfigOption, stored
from touchline.cli.console import Enough, EnoughOption, exit_below
from touchline.core.errors import Conflict
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.evaluate.headline_figures import HEADLINE, what_is_missing
from touchline.images import frame_from_bytes
from touchline.report.contents import ReportPicture, contents, outcome, report_picture
from touchline.report.page import draw, page

ID = re.compile(r"[0-9a-f]{16}")

CalibrationOrId = Annotated[
    str,
    typer.Argument(
        metavar="CAL.json|ID",
        help="A calibration from calibrate or exported "
        "as json; or the id of a calibration in the data folder of a server "
        "that is not running.",
    ),
]
PictureFile = Annotated[
    Path | None,
    typer.Option(
        "--picture",
        metavar="IMAGE",
        help="The calibration image. With an ID, the saved image is used.",
    ),
]
OutFile = Annotated[
    Path | None,
    typer.Option("--out", "--output", "-o", metavar="REPORT.html", help="The page to write."),
]
DataFolder = Annotated[
    Path | None, typer.Option("--data", metavar="DIR", help="Data folder of the server, for an ID.")
]


def report(
    calibration: CalibrationOrId,
    picture: PictureFile = None,
    output: OutFile = None,
    enough: EnoughOption = Enough.fair,
    data: DataFolder = None,
    config: ConfigOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Show or write the report of one calibration. Exit code 0 if it is good enough."""
    known, shown = _calibration_and_picture(calibration, picture, data, config)
    report_contents = contents(known, shown)
    text = (
        json.dumps(report_contents, allow_nan=False)
        if as_json
        else _summary(report_contents, output)
    )
    if output is not None:
        files.write_bytes(
            output,
            page(report_contents, draw(known, shown, report_contents)).encode("utf-8", "replace"),
        )
    print(text)
    exit_below(enough, report_contents["verdict"]["level"])


def _calibration_and_picture(
    calibration: str, picture: Path | None, data: Path | None, config: Path | None
) -> tuple[Calibration, ReportPicture]:
    """Return the calibration of a file or an id, and the picture that was clicked, if it is given or stored."""
    if ID.fullmatch(calibration) and not Path(calibration).exists():
        known, shown = _stored(calibration, data, config)
    else:
        known, shown = (
            files.read_calibration(Path(calibration)),
            ReportPicture(None, "No image was given."),
        )
    if picture is not None:
        frame = files.read_picture(picture)
        if frame.size != known.image_size:
            raise Conflict(
                f"{picture} has {frame.size}; the calibration is for {known.image_size}.",
                "Use the calibration image.",
                reason="size-mismatch",
            )
        shown = ReportPicture(frame)
    return known, shown


def _stored(id: str, data: Path | None, config: Path | None) -> tuple[Calibration, ReportPicture]:
    with stored(data, config) as (store, _):
        calibration = store.calibrations.get(id)
        return calibration, report_picture(
            calibration, lambda snapshot: frame_from_bytes(store.snapshots.picture(snapshot))
        )


def _summary(contents: JsonObject, output: Path | None) -> str:
    lines = [f"{contents['verdict']['level']}: {contents['verdict']['sentence']}"]
    lines += [
        f"{it['title']}: {it['value']:.{HEADLINE[key].digits}f} {it['unit']}".rstrip()
        for key, it in contents["figures"].items()
        if it["value"] is not None
    ]
    lines += what_is_missing(contents["figures"])
    lines += [
        " ".join(
            filter(None, (f"{outcome(claim)}: {claim['title']}.", claim["evidence"], claim["fix"]))
        )
        for claim in contents["claims"]
        if claim["state"] != "held"
    ]
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in contents["warnings"]]
    if contents["picture"]["same"] is False:
        lines.append("Warning: This is not the calibration image: its sha256 differs.")
    return "\n".join([*lines, *([f"Saved as {output}."] if output else [])])
