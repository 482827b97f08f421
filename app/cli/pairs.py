"""pair: whether two cameras that see the same agree."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from app.cli import files
from app.cli.progress import progress_bar
from app.cli.requests import AsJson
from app.workflows.pair import evaluate_pair
from app.workflows.pair_types import PairReport


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
    print(json.dumps(found, allow_nan=False) if as_json else _summary(found))


def _summary(found: PairReport) -> str:
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
