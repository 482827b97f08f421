"""auto: a calibration from the field's own lines, without a click."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.automatic.recognition import AUTO, request_for
from touchline.cli import files, requests
from touchline.cli.progress import progress_bar
from touchline.core.errors import FitFailed
from touchline.core.jobs import subprogress
from touchline.core.records import Calibration
from touchline.core.sentences import marking_names
from touchline.models import model_of
from touchline.models.ray_camera import RayCamera
from touchline.workflows.job_pictures import median_frame


def auto(
    pictures: Annotated[
        list[Path],
        typer.Argument(
            metavar="PICTURES…",
            help="Images of one camera. Moving objects are removed if there are several images.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="CAL.json",
            help="The calibration to write if all checks pass.",
        ),
    ] = None,
    field: Annotated[
        str,
        typer.Option(
            "--field", help="Field name, such as ssl-2008. auto: the one that the image shows."
        ),
    ] = AUTO,
    region: Annotated[
        str,
        typer.Option(
            "--region", help="Covered area of the field. auto: the part that the image shows."
        ),
    ] = AUTO,
    rotate: requests.Rotate = None,
    model: Annotated[
        str,
        typer.Option(
            "--model",
            help="Camera model. auto: Brown–Conrady, or the first other model that can be fitted.",
        ),
    ] = "auto",
    option: requests.Options = None,
    lens: requests.LensFile = None,
    lens_sigma: requests.LensSigma = None,
    height_mm: requests.HeightMm = None,
    height_sigma_mm: requests.HeightSigmaMm = None,
    turn_deg: Annotated[
        float | None,
        typer.Option("--turn", help="Approximate clockwise rotation of the region in the image."),
    ] = None,
    corners: Annotated[
        str | None,
        typer.Option(
            "--corners",
            metavar="X,Y X,Y X,Y X,Y",
            help="Top left, top right, "
            "bottom right and bottom left corner of the region as it is when "
            "corrected, in the image, a few pixels off. For images whose lines "
            "are not recognised without.",
        ),
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(
            "--points",
            metavar="POINTS.json",
            help="Write the detected points in the format of calibrate, also if a check fails.",
        ),
    ] = None,
    note: Annotated[str, typer.Option("--note", help="Saved with the calibration.")] = "",
    fields: requests.OwnFields = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the complete result as JSON.")
    ] = False,
) -> None:
    """Detect the field lines in an image and calibrate from them, if all checks pass."""
    options = requests.options_from(option, lens, lens_sigma, height_mm, height_sigma_mm)
    known = {
        "height_mm": height_mm,
        "turn_deg": turn_deg,
        "corners": None if corners is None else requests.corners_from(corners),
    }
    rough = {name: value for name, value in known.items() if value is not None}
    task = request_for(
        requests.own_fields(fields),
        field,
        region,
        rotate,
        model=model,
        options=options,
        rough=rough,
        note=note,
    )
    with progress_bar("Detecting lines") as progress, files.decoded(pictures) as reads:
        frame = median_frame(reads, subprogress(progress, 0.0, 0.1))
        found, calibration = task.answer(frame, subprogress(progress, 0.1, 1.0), reads)
    answer: Mapping[str, Any] = found
    recognised = answer.get("recognised")
    text = (
        json.dumps(found, allow_nan=False)
        if as_json
        else ("" if calibration is None else _summary(found, calibration, output))
    )
    if points is not None:
        kept = {
            key: found[key]
            for key in ("field", "region", "rotate", "model", "image_size", "observations")
        }
        files.write_bytes(points, json.dumps(kept, allow_nan=False).encode())
    if output is not None and calibration is not None:
        files.write_calibration(output, calibration)
    if text:
        print(text)
    if calibration is None:
        verdict, choices = found["verdict"], recognised["choices"] if recognised else []
        ways = [
            f"--field {c['field']} --region {c['region']} --rotate {c['rotate']}" for c in choices
        ]
        fix = f"Use one of: {'; '.join(ways)}." if len(ways) > 1 else verdict["fix"]
        raise FitFailed(verdict["sentence"], fix, reason=verdict["reason"])


def _summary(found: Mapping[str, Any], calibration: Calibration, output: Path | None) -> str:
    report, proof = found["report"], found["proof"]
    count = sum(len(o["points"]) for o in found["observations"])
    best = found["candidates"][0]
    lines = [
        *_recognised(found.get("recognised")),
        found["verdict"]["sentence"],
        f"{count} points on {len(found['observations'])} markings; {100 * proof['unexplained_share']:.0f} % of "
        "the lines detected on the carpet do not belong to the field.",
        f"Camera {_height(best, report, calibration)} above the carpet, region rotated by "
        f"{round(best['turn_deg'])}° in the image.",
    ]
    lines += (
        [f"Not detected: {', '.join(marking_names(proof['missing']))}."] if proof["missing"] else []
    )
    lines += (
        ["The field rotated by 180° would look the same. The orientation of the region is used."]
        if any(c["turned"] for c in found["candidates"])
        else []
    )
    lines += [f"Warning: {warning['text']} {warning['fix']}" for warning in report["warnings"]]
    return "\n".join([*lines, *([f"Saved as {output}."] if output is not None else [])])


def _recognised(recognition: Mapping[str, Any] | None) -> list[str]:
    """Say which field and part the image shows, and how well the next best field would explain it."""
    if recognition is None:
        return []
    runner_up = recognition["runner_up"]
    return [
        recognition["sentence"]
        + (
            f" The next best field, {runner_up['title']}, explains the lines "
            f"{100 * runner_up['share']:.0f} % as well."
            if runner_up
            else ""
        )
    ]


def _height(first: dict[str, Any], report: dict[str, Any], calibration: Calibration) -> str:
    """Say how high the camera hangs, with the 95 % that are known of it; as first found for a model without rays."""
    model = model_of(calibration)
    if not isinstance(model, RayCamera):
        return f"about {first['height_mm'] / 1000:.1f} m"
    known = report.get("covariance") or {"names": ()}
    if "height" not in known["names"]:
        return f"{model.position_mm[2] / 1000:.2f} m"
    at = known["names"].index("height")
    return (
        f"{model.position_mm[2] / 1000:.2f} ± {1.96 * known['matrix'][at][at] ** 0.5 / 1000:.2f} m"
    )
