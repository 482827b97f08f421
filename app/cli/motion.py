"""motion: how far the tracks of what rolls in a film bow, raw and corrected."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer


def motion(
    film: Annotated[Path, typer.Argument(metavar="FILM", help="Of a still camera: MP4, MOV, AVI, MKV or WebM.")],
    calibration: Annotated[Path | None, typer.Option("--calibration", metavar="CAL.json", help="Judge this one: what "
                                                     "distortion it leaves.")] = None,
    drawn: Annotated[Path | None, typer.Option("--drawn", metavar="PICTURE", help="Write the last frame with the rolls "
                                               "drawn over it.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole report as JSON.")] = False,
) -> None:
    """Follow a ball or robot through a film and say how far its straight rolls bow."""
    from app.cli import files
    from app.cli.words import progress_bar
    from app.motion_task import rolls_in_film

    model: dict[str, Any] | None = None
    if calibration is not None:
        told = files.read_calibration(calibration)
        model = {"id": told.id or calibration.name, "image_size": list(told.image_size), "name": told.model_name,
                 "parameters": told.model_parameters}
    with progress_bar("Following what moves") as progress:
        found = rolls_in_film(film.absolute(), model, progress)
    if drawn is not None:
        files.write_picture(drawn, _drawn(film, found))
    print(json.dumps(found, allow_nan=False) if as_json else _summary(found))


def _summary(found: dict[str, Any]) -> str:
    lines = [found["sentence"]]
    for where in ("raw", "corrected"):
        told = found[where]
        if told is None or told["border_sigma_pct"] is None:
            continue
        lines.append(f"{where.capitalize()}: {told['border_pct']:+.2f} ± {told['border_sigma_pct']:.2f} % along the "
                     "edge.")
        lines += [f"  roll {number}: {roll['length_px']:.0f} px, bow {roll['bow_pct']:+.2f} ± {roll['sigma_pct']:.2f} "
                  f"%, rms {roll['rms_px']:.2f} px" + ("" if roll["used"] else ", left out")
                  for number, roll in enumerate(told["rolls"], 1)]
    if found["lens"] is not None:
        lines.append(f"As plumb lines: {found['lens']['sentence']}")
    return "\n".join(lines)


def _drawn(film: Path, found: dict[str, Any]) -> Any:
    import cv2
    import numpy as np

    from app.motion_task import last_frame
    pixels = last_frame(film.absolute()).copy()
    for run in found["runs"]:
        cv2.polylines(pixels, [np.round(run["points"]).astype(np.int32)], False, (0, 200, 255), 2, cv2.LINE_AA)
    return pixels
