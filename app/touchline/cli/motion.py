"""motion: how far the tracks of what rolls in a film bow, raw and corrected, and the lens that follows from it."""

import json
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
import typer

from touchline.cli import files
from touchline.cli.console import say
from touchline.cli.progress import progress_bar
from touchline.cli.requests import ReportAsJson
from touchline.workflows import rolling_request


def motion(
    film: Annotated[Path, typer.Argument(metavar="FILM", help="Video of a fixed camera: MP4, MOV, AVI, MKV or WebM.")],
    calibration: Annotated[Path | None, typer.Option("--calibration", metavar="CAL.json", help="Measure the "
                                                     "distortion after correction with this calibration.")] = None,
    drawn: Annotated[Path | None, typer.Option("--drawn", metavar="PICTURE", help="Write the last frame with the "
                                               "rolls as an overlay.")] = None,
    lens: Annotated[Path | None, typer.Option("--lens", metavar="LENS.json", help="Write the lens from the rolls, for "
                                              "calibrate --lens.")] = None,
    kind: Annotated[str, typer.Option("--kind", help="Model of that lens: auto, division, division-even or "
                                      "brown-conrady.")] = "auto",
    refined: Annotated[Path | None, typer.Option("--refined", metavar="NEW.json", help="Fit the calibration again to "
                                                 "its own points and these rolls, and write it.")] = None,
    as_json: ReportAsJson = False,
) -> None:
    """Track a ball or robot through a video and measure the curvature of its straight rolls."""
    if refined is not None and calibration is None:
        raise typer.BadParameter("--refined requires --calibration", param_hint="--refined")
    rolling_request.check("report", kind, 0.0)
    known = None if calibration is None else files.read_calibration(calibration)
    refinable = rolling_request.check_refinable(known) if refined is not None else None
    with progress_bar("Tracking moving objects") as progress:
        rolling = rolling_request.track_film(film.absolute(), progress, known)
    found = rolling.report(*rolling_request.model_for_size(known, rolling.size))
    told = json.dumps(found, allow_nan=False) if as_json else _summary(found)
    note = f"From {film.name}"
    made = None if lens is None else rolling_request.lens_record(rolling.rolls, rolling.size, kind, note=note)
    better = None if refinable is None else rolling_request.refine(
        refinable, rolling_request.lens_record(rolling.rolls, rolling.size, refinable.model_name))
    if drawn is not None:
        files.write_picture(drawn, _drawn(rolling.last, found))
    if lens is not None and made is not None:
        files.write_lens(lens, made)
    if refined is not None and better is not None:
        files.write_calibration(refined, better)
    print(told)
    for path in (lens, refined):
        if path is not None:
            say(f"Saved as {path}.")


def _summary(found: dict[str, Any]) -> str:
    lines = [found["sentence"]]
    for where in ("raw", "corrected"):
        view = found[where]
        if view is None or view["border_sigma_pct"] is None:
            continue
        lines.append(f"{where.capitalize()}: {view['border_pct']:+.2f} ± {view['border_sigma_pct']:.2f} % along the "
                     "edge.")
        lines += [f"  roll {roll['number'] + 1}: {roll['length_px']:.0f} px, bow {roll['bow_pct']:+.2f} ± "
                  f"{roll['spread_pct']:.2f} %, rms {roll['rms_px']:.2f} px" + ("" if roll["used"] else ", excluded")
                  for roll in view["rolls"]]
    if found["lens"] is not None:
        lines.append(f"Lens: {found['lens']['sentence']}")
    return "\n".join(lines)


def _drawn(last: Any, found: dict[str, Any]) -> Any:
    pixels = last.copy()
    for run in found["runs"]:
        cv2.polylines(pixels, [np.round(run["points"]).astype(np.int32)], False, (0, 200, 255), 2, cv2.LINE_AA)
    return pixels
