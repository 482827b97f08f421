"""report: one calibration as a page to print or keep, as JSON, and as an exit code for scripts."""

import json
import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli.server import ConfigOption

POOR = 5
ID = re.compile(r"[0-9a-f]{16}")


class Enough(StrEnum):
    good = "good"
    fair = "fair"
    any = "any"


ACCEPTED = {Enough.good: {"good"}, Enough.fair: {"good", "fair"}, Enough.any: {"good", "fair", "poor", "unknown"}}

CalibrationOrId = Annotated[str, typer.Argument(metavar="CAL.json|ID", help="As calibrate wrote it, or exported as "
                                                "json; or the id of one that a server on this machine keeps, while it "
                                                "is not running.")]
PictureFile = Annotated[Path | None, typer.Option("--picture", metavar="IMAGE", help="The picture that was clicked; by "
                                                  "ID the one that was kept.")]
OutFile = Annotated[Path | None, typer.Option("--out", "--output", "-o", metavar="REPORT.html", help="The page to "
                                              "write.")]
EnoughOption = Annotated[Enough, typer.Option("--enough", help=f"Exit code {POOR} for a verdict below this.")]
DataFolder = Annotated[Path | None, typer.Option("--data", metavar="DIR", help="Where the server keeps everything; "
                                                 "for an ID.")]


def report(calibration: CalibrationOrId, picture: PictureFile = None, output: OutFile = None,
           enough: EnoughOption = Enough.fair, data: DataFolder = None, config: ConfigOption = None,
           as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False) -> None:
    """Say, write or print everything that is known of one calibration; 0 if it is good enough."""
    from app import report as made
    from app.cli import files

    known, shown = known_and_shown(calibration, picture, data, config)
    said = made.contents(known, shown)
    if output is not None:
        html = made.page(said, made.draw(known, shown, said))
        files.write_bytes(output, html.encode("utf-8", "replace"))
    if as_json:
        print(json.dumps(said, allow_nan=False))
    else:
        print(_in_short(said, output))
    if said["verdict"]["level"] not in ACCEPTED[enough]:
        raise typer.Exit(POOR)


def known_and_shown(calibration: str, picture: Path | None, data: Path | None, config: Path | None) -> tuple[Any, Any]:
    """The calibration of a file or an id, and the picture that was clicked as far as it is given or kept."""
    from app import report as made
    from app.cli import files

    known, shown = (_kept(calibration, data, config) if _is_id(calibration) else
                    (files.read_calibration(Path(calibration)), None))
    if picture is not None:
        shown = made.ReportPicture(_of_its_size(files.read_picture(picture), known, picture))
    return known, shown or made.ReportPicture(None, "No picture was given.")


def _is_id(word: str) -> bool:
    return ID.fullmatch(word) is not None and not Path(word).exists()


def _kept(id: str, data: Path | None, config: Path | None) -> tuple[Any, Any]:
    """A calibration of the data folder with its picture."""
    from app.cli.console import FileTrouble
    from app.images import frame_from_bytes
    from app.main import store_of
    from app.report import report_picture
    from app.settings import load_settings

    settings = load_settings(config, data=data)
    if not settings.data.is_dir():
        raise FileTrouble(f"There is no data folder {settings.data}.", "Name the one that the server uses with --data.")
    with store_of(settings) as store:
        calibration = store.calibration(id)
        return calibration, report_picture(calibration, lambda snapshot: frame_from_bytes(store.picture(snapshot)))


def _of_its_size(frame: Any, known: Any, path: Path) -> Any:
    from app.core.errors import Conflict

    if frame.size != known.image_size:
        raise Conflict(f"{path} is {frame.size.width} × {frame.size.height} px; the calibration was made for "
                       f"{known.image_size.width} × {known.image_size.height} px.",
                       "Give the picture that was clicked.", reason="size-mismatch")
    return frame


def _in_short(said: dict[str, Any], output: Path | None) -> str:
    """The verdict, the figures that are known, every warning with its cure."""
    from app.report.figures import HEAD

    lines = [f"{said['verdict']['level']}: {said['verdict']['sentence']}"]
    lines += [f"{it['title']}: {it['value']:.{HEAD[key].digits}f} {it['unit']}".rstrip()
              for key, it in said["figures"].items() if it["value"] is not None]
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in said["warnings"]]
    if said["picture"]["same"] is False:
        lines.append("Warning: This is not the picture that was clicked: its sha256 is another one.")
    return "\n".join([*lines, *([f"Written to {output}."] if output else [])])
