"""pair, rig check, rig stitch: whether cameras that see the same agree, from files or from a data folder."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli import files
from touchline.cli.archive import ConfigOption, stored
from touchline.cli.console import Enough, EnoughOption, exit_below
from touchline.cli.progress import progress_bar
from touchline.cli.requests import AsJson
from touchline.core.errors import BadInput, Conflict
from touchline.core.field_json import field_from_json
from touchline.evaluate.cameras.rectangles import NAMES
from touchline.imaging.mosaic import FieldView, stitcher_of
from touchline.store.fields import FieldRepository
from touchline.workflows.pair import evaluate_pair
from touchline.workflows.pair_types import PairReport
from touchline.workflows.rig import check as check_rig
from touchline.workflows.rig import refuse_other_sizes
from touchline.workflows.rig_types import RigCheck

rig = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None,
                  help="Cameras that share a field: compare them, or join their images.")
WhichRig = Annotated[list[str], typer.Argument(metavar="CAL.json… | NAME", help="Calibrations of cameras over one "
                                               "field; or the name of a rig in the data folder of a server that is "
                                               "not running.")]
PictureFiles = Annotated[list[Path] | None, typer.Option("--picture", metavar="IMAGE", help="Current image of each "
                                                         "camera, in the order of the cameras. Repeat for each.")]
DataFolder = Annotated[Path | None, typer.Option("--data", metavar="DIR",
                                                 help="Data folder of the server, for a NAME.")]


def pair(
    matches: Annotated[Path | None, typer.Argument(metavar="[MATCHES.json]", help='Matched points: {"points_a": [[x, '
                                                   'y], …], "points_b": […]}, raw px.')] = None,
    a: Annotated[Path | None, typer.Option("--a", metavar="CAL.json", help="The first camera's calibration.")] = None,
    b: Annotated[Path | None, typer.Option("--b", metavar="CAL.json", help="The second camera's calibration.")] = None,
    z_mm: Annotated[float, typer.Option("--z", min=0, max=5000, help="Height of the matched points, mm.")] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Compare two cameras by matched points, by their calibrations, or by both."""
    given: dict[str, Any] = files.read_matches(matches) if matches is not None else {}
    one, other = (files.read_calibration(path) if path is not None else None for path in (a, b))
    with progress_bar("Comparing the cameras") as progress:
        found = evaluate_pair(given.get("points_a"), given.get("points_b"), one, other, given.get("z_mm", z_mm),
                              progress)
    print(json.dumps(found, allow_nan=False) if as_json else _pair_summary(found))


def _pair_summary(found: PairReport) -> str:
    """Millimetres first: they are what play depends on."""
    lines = []
    if (agreed := found["agreement"]) is not None:
        x, y = agreed["where"]
        lines.append(f"The cameras agree within {agreed['median_mm']:.1f} mm (median), {agreed['rms_mm']:.1f} mm rms, "
                     f"{agreed['max_mm']:.1f} mm at most, at ({x:.0f}, {y:.0f}) mm; both cover "
                     f"{agreed['overlap_m2']:.2f} m² of the field.")
    if (known := found["calibrated"]) is not None:
        lines.append(f"The matches are {known['median_px']:.2f} px (median) from the positions predicted by the two "
                     "calibrations.")
    if (pose := found["pose"]) is not None:
        lines.append(f"Relative camera pose from the matches alone: rotation ± "
                     f"{pose['rotation_sigma_deg']:.2g}°, direction ± {pose['direction_sigma_deg']:.2g}°.")
    if (between := found["fundamental"]) is not None:
        rows = "\n".join("  " + " ".join(f"{v: .9e}" for v in row) for row in between["matrix"])
        good = found["matches"] - len(between["outliers"])
        lines.append(f"Fundamental matrix from {good} of {found['matches']} matches, "
                     f"{between['rms_px']:.2f} px rms from the epipolar lines:\n{rows}")
    for part in (found["agreement"], found["calibrated"], found["pose"], found["fundamental"]):
        if part is not None:
            verdict = part["verdict"]
            lines.append(f"{verdict['level'].capitalize()}. {verdict['sentence']} {verdict['fix']}".rstrip())
    lines += [f"No {failed['part']}: {failed['what']} {failed['fix']}" for failed in found["failed"]]
    return "\n".join(lines)


@rig.command()
def check(
    which: WhichRig, picture: PictureFiles = None,
    matches: Annotated[Path | None, typer.Option("--matches", metavar="MATCHES.json", help="Points that both of the "
                                                 "first two cameras cover, in the format of pair.")] = None,
    z_mm: Annotated[float, typer.Option("--z", min=0, max=5000, help="Height of the matched points, mm.")] = 0.0,
    enough: EnoughOption = Enough.fair, data: DataFolder = None, config: ConfigOption = None,
    as_json: AsJson = False,
) -> None:
    """How far cameras are apart where two of them see the same carpet; 0 if that is good enough."""
    known, pictures = _rig(which, picture, data, config)
    given = []
    if matches is not None:
        names = [camera["camera"] for camera in known["cameras"]]
        if len(names) < 2:
            raise BadInput("Matches require two cameras.", "Use two calibrations.", reason="one-sided")
        a, b = names[:2]
        given = [{"a": a, "b": b, "z_mm": z_mm, **files.read_matches(matches)}]
    with progress_bar("Checking the rig") as progress:
        found = check_rig(known, pictures, given, progress)
    print(json.dumps(found, allow_nan=False) if as_json else _summary(found))
    exit_below(enough, found["verdict"]["level"])


@rig.command()
def stitch(
    which: WhichRig, picture: PictureFiles = None,
    output: Annotated[Path, typer.Option("--out", "--output", "-o", metavar="OUT.png", help="PNG or JPEG, by the file "
                                         "name extension.")] = Path("stitched.png"),
    width: Annotated[int, typer.Option("--width", min=64, max=8192, help="Width of the image, px.")] = 1600,
    data: DataFolder = None, config: ConfigOption = None,
) -> None:
    """The whole field corrected in one picture of all cameras; says what none of them sees."""
    known, pictures = _rig(which, picture, data, config)
    if not pictures:
        raise BadInput("No image was given.", "Give one image for each camera: --picture IMAGE.", reason="no-picture")
    refuse_other_sizes(known, pictures)
    stitcher, names = stitcher_of(known, pictures, FieldView(field_from_json(known["field"]), width))
    files.write_picture(output, stitcher.stitch([pictures[name] for name in names]))
    view = stitcher.view
    print(f"{output}: {view.size}, {1 / view.px_per_mm:.2g} mm a px. {stitcher.unseen_summary()['words']}")


def _rig(which: list[str], picture: list[Path] | None, data: Path | None,
         config: Path | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the rig as workflows.rig takes it, and its pictures by camera."""
    named = len(which) == 1 and not Path(which[0]).suffix and not Path(which[0]).exists()
    known = _stored(which[0], data, config) if named else _of_files([Path(word) for word in which])
    cameras, given = [camera["camera"] for camera in known["cameras"]], picture or []
    if len(given) > len(cameras):
        raise BadInput(f"There are {len(given)} images for {len(cameras)} cameras.", "Give one image for each "
                       "camera, in the order of the cameras.", reason="too-many-pictures")
    return known, {name: files.read_picture(path).pixels for name, path in zip(cameras, given, strict=False)}


def _of_files(paths: list[Path]) -> dict[str, Any]:
    calibrations = [files.read_calibration(path) for path in paths]
    if len({json.dumps(calibration.field, sort_keys=True) for calibration in calibrations}) > 1:
        raise Conflict("The calibrations are for different fields.", "Use calibrations for one field.",
                       reason="different-fields")
    names = [path.stem for path in paths]
    names = names if len(set(names)) == len(names) else [str(path) for path in paths]
    if len(set(names)) < len(names):
        raise Conflict("A calibration was given twice.", "Give each calibration once.", reason="camera-twice")
    return {"name": "", "title": "", "field": dict(calibrations[0].field), "rectangles": {}, "cameras": [
        {"camera": name, "title": name, "region": None, "rotate": None, "calibration": calibration.to_json(),
         "picture": None} for name, calibration in zip(names, calibrations, strict=True)]}


def _stored(name: str, data: Path | None, config: Path | None) -> dict[str, Any]:
    with stored(data, config) as (store, settings):
        body = store.rigs.get(name).body
        cameras = []
        for camera in body["cameras"]:
            active = store.calibrations.active(camera["camera"])
            cameras.append({**camera, "title": camera["camera"], "picture": None,
                            "calibration": active.to_json() if active else None})
        return {"name": name, "title": body["title"], "cameras": cameras,
                "field": FieldRepository(settings.own_fields)[body["field"]].to_json(),
                "rectangles": {one: body[one] for one in NAMES}}


def _summary(found: RigCheck) -> str:
    verdict = found["verdict"]
    lines = [f"{verdict['level'] or 'unknown'}: {verdict['sentence']} {verdict['fix']}".rstrip()]
    for pair in found["pairs"]:
        if pair["verdict"] is not None:
            lines.append(f"{pair['a']} – {pair['b']} (by {pair['from']}): {pair['verdict']['sentence']}")
        elif pair["failed"] is not None:
            lines.append(f"{pair['a']} – {pair['b']}: {pair['failed']['what']} {pair['failed']['fix']}")
        matches = pair["matches"]
        if matches is not None and "calibrated" in matches and (crossed := matches["calibrated"]) is not None:
            lines.append(f"  The matches are {crossed['median_px']:.2f} px (median) from the positions predicted by "
                         "the calibrations.")
    lines += [f"{t['text']} {t['fix']}" for camera in found["cameras"] for t in camera["troubles"]]
    return "\n".join(lines)
