"""detect: ball and robots in a picture, in field millimetres."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from touchline.cli import files
from touchline.cli.files import points_from_pairs
from touchline.cli.requests import AsJson
from touchline.core.colour_profile import ColourProfile
from touchline.core.errors import BadInput
from touchline.core.strict_yaml import MAX_BYTES, plain_from_yaml
from touchline.store.stages import load_plan, named_plan
from touchline.workflows.detection import context_for
from touchline.workflows.detection import detect as detect_in
from touchline.workflows.detection import detections_image as draw_over


def detect(
    picture: Annotated[Path, typer.Argument(metavar="PICTURE", help="PNG, JPEG, BMP or WebP.")],
    calibration: Annotated[Path | None, typer.Option("--calibration", metavar="CAL.json", help="Calibration of this "
                                                     "camera at this image size, for positions.")] = None,
    stages: Annotated[str, typer.Option("--stages", metavar="NAME|PLAN.yaml", help="ssl, vsss, mirosot, or a file "
                                        "with your own plan.")] = "ssl",
    colours: Annotated[Path | None, typer.Option("--colours", metavar="PROFILE.yaml", help="Colour profile.")] = None,
    click: Annotated[list[str] | None, typer.Option("--click", metavar="COLOUR=X,Y", help="A point of that colour in "
                                                    "this image, or a box X0,Y0,X1,Y1. May be repeated.")] = None,
    mm_per_px: Annotated[float | None, typer.Option("--mm-per-px", min=0.01, max=1000, help="Size of a pixel, if "
                                                    "there is no calibration.")] = None,
    eye: Annotated[str | None, typer.Option("--eye", metavar="X,Y,HEIGHT", help="Camera position in field mm, for a "
                                            "model that is not a physical lens model.")] = None,
    drawn: Annotated[Path | None, typer.Option("--drawn", metavar="PICTURE", help="Write the image with the "
                                               "detections.")] = None,
    stage_pictures: Annotated[Path | None, typer.Option("--stage-pictures", metavar="DIR", help="Write the result of "
                                                        "each stage.")] = None,
    save_colours: Annotated[Path | None, typer.Option("--save-colours", metavar="PROFILE.yaml", help="Save the colour "
                                                      "profile for other images.")] = None,
    corrected: Annotated[bool, typer.Option("--corrected", help="Correct the image before the detection.")] = False,
    as_json: AsJson = False,
) -> None:
    """Detect the ball and the robots in an image, with numbers, orientations and positions."""
    known = None if calibration is None else files.read_calibration(calibration)
    profile = None if colours is None else ColourProfile.from_json(
        plain_from_yaml(files.read_bytes(colours, MAX_BYTES), f"The file {colours.name}"))
    plan, frame, eye_mm = _plan(stages), files.read_picture(picture), _eye(eye)
    plan = replace(plan, corrected=True) if corrected else plan
    wanted = [name for name, _ in plan.stages] if stage_pictures is not None else []
    found = detect_in(frame.pixels, plan, calibration=known, profile=profile, clicks=_clicks(click or []),
                      mm_per_px=mm_per_px, eye_mm=eye_mm, pictures=wanted)
    if drawn is not None:
        view = context_for(frame.size, found.profile, known, mm_per_px, eye_mm).view
        files.write_picture(drawn, draw_over(frame.pixels, found.seen.detections, view))
    if stage_pictures is not None:
        for number, (name, pixels) in enumerate(found.seen.pictures.items(), 1):
            files.write_picture(stage_pictures / f"{number}-{name}.png", pixels)
    if save_colours is not None:
        text = yaml.safe_dump(found.profile.to_json(), sort_keys=False, allow_unicode=True)
        files.write_bytes(save_colours, text.encode())
    print(json.dumps(found.to_json(), allow_nan=False) if as_json else _summary(found.to_json()))


def _plan(stages: str) -> Any:
    return load_plan(Path(stages)) if stages.endswith((".yaml", ".yml")) else named_plan(stages)


def _eye(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    parts = text.split(",")
    if len(parts) != 3:
        raise BadInput(f"{text!r} is not a camera position.", "Write it as x,y,height in mm.", reason="bad-eye")
    (x, y), (height, _) = points_from_pairs([",".join(parts[:2]), f"{parts[2]},0"])
    if not height > 0:
        raise BadInput("The camera must be above the carpet.", "Give its height as the third value, in mm.",
                       reason="bad-eye")
    return float(x), float(y), float(height)


def _clicks(texts: list[str]) -> dict[str, list[list[float]]]:
    found: dict[str, list[list[float]]] = {}
    for text in texts:
        colour, _, place = text.partition("=")
        parts = place.split(",")
        if len(parts) not in (2, 4):
            raise BadInput(f"{text!r} is not a point of a colour.", "Write it as colour=x,y or colour=x0,y0,x1,y1.",
                           reason="bad-clicks")
        pairs = [",".join(parts[i:i + 2]) for i in range(0, len(parts), 2)]
        found.setdefault(colour, []).append(points_from_pairs(pairs).ravel().tolist())
    return found


def _summary(found: dict[str, Any]) -> str:
    lines = [f"{'what':<14}{'x mm':>9}{'y mm':>9}{'± mm':>7}{'front °':>9}{'conf.':>6}   px"]
    order = {"ball": 0, "robot": 1, "marker": 2}
    things = sorted(found["detections"], key=lambda d: (order[d["kind"]], d["team"] or "", -1 if d["id"] is None
                                                        else d["id"]))
    lines += [_line(thing) for thing in things] or ["Nothing was detected."]
    if any(thing["on_carpet"] for thing in things):
        lines.append("Robot positions are where their line of sight meets the carpet, because the model is not a "
                     "physical lens model. Use --eye.")
    lines += [h["sentence"] for h in found["health"] if h["level"] != "good"]
    lines += found["notes"]
    total = sum(found["took_ms"].values())
    lines.append(f"{total:.1f} ms: " + ", ".join(f"{name} {ms:.1f}" for name, ms in found["took_ms"].items()))
    return "\n".join(lines)


def _line(thing: dict[str, Any]) -> str:
    name = " ".join(str(part) for part in (thing["team"], "?" if thing["kind"] == "robot" and thing["id"] is None
                                           else thing["id"]) if part is not None) or thing["kind"]
    place = ("" if thing["x_mm"] is None else f"{thing['x_mm']:9.1f}{thing['y_mm']:9.1f}")
    spread = thing["covariance_mm2"]
    sigma = "" if spread is None else f"{((spread[0][0] + spread[1][1]) / 2) ** 0.5:.1f}"
    turn = "" if thing["orientation_deg"] is None else f"{thing['orientation_deg']:.1f}"
    x, y = thing["pixel"]
    return f"{name:<14}{place:>18}{sigma:>7}{turn:>9}{thing['confidence']:6.2f}   {x:.1f}, {y:.1f}"
