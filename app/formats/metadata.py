"""What other formats have no place for, in one line of ours: the field, the region, how it is drawn, and where the
camera hangs where the format cannot say.

    # touchline: {"field": "ssl-div-b", "region": "full", …}

A comment in YAML and mrcal's files, an entry of its own in JSON. Without it a file is a lens, with it a calibration.
"""

import json
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.core.field import QUARTER_TURNS
from app.core.records import Calibration
from app.formats.approximation import Held
from app.formats.numbers import entry, number, numbers, refuse, whole

MARK = re.compile(rb"^# touchline: ([^\r\n]*)", re.MULTILINE)
HEAD_BYTES = 8192
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class Pose:
    """rotation: camera_from_field as a rotation vector; position_mm: the centre of projection in the field."""

    rotation: tuple[float, float, float]
    position_mm: tuple[float, float, float]


@dataclass(frozen=True)
class About:
    """What a file says of the field that its camera hangs over; all None in a file from elsewhere."""

    field: str | None = None
    region: str | None = None
    rotate: int | None = None
    rectangle: tuple[float, float, int, int] | None = None  # width_px, height_px, n_rectangles_x and _y
    camera: str | None = None
    pose: Pose | None = None


def about_json(calibration: Calibration, held: Held, *, pose: bool) -> dict[str, Any]:
    """pose: whether the format has no place of its own for it."""
    camera = held.camera
    about = {"field": calibration.field["name"], "region": calibration.region, "rotate": calibration.rotate,
             "rectangle": [camera.width_px, camera.height_px, camera.n_rectangles_x, camera.n_rectangles_y],
             "camera": calibration.camera}
    if pose:
        about |= {"rotation": list(camera.rotation), "position_mm": list(camera.position_mm)}
    if held.loss is not None:
        about |= {"approximates": calibration.model_name, "error_mm": held.loss.to_json()}
    return about


def header(calibration: Calibration, held: Held, *words: str, pose: bool) -> str:
    """Lines of comment: what this is, what it costs, and the line that is read back."""
    lines = ["A camera over a playing field, calibrated by Touchline.", *words]
    if held.loss is not None:
        hat = "" if held.loss.hat_worst_mm is None else (
            f", {held.loss.hat_worst_mm:.3f} mm {held.loss.hat_height_mm:g} mm above it")
        lines.append(f"Nearest lens of this format to {calibration.model_name}: at worst {held.loss.worst_mm:.3f} mm "
                     f"off on the carpet, {held.loss.rms_mm:.3f} mm rms{hat}.")
    lines.append("touchline: " + json.dumps(about_json(calibration, held, pose=pose), allow_nan=False))
    return "".join(f"# {line}\n" for line in lines)


def about_in(data: bytes) -> About:
    """The line of ours in a file's first lines; BadInput if it is spoilt, nothing if there is none."""
    found = MARK.search(data[:HEAD_BYTES])
    if found is None:
        return About()
    try:
        value = json.loads(found[1].decode())
    except (ValueError, RecursionError):
        raise refuse("The line that begins with # touchline: is spoilt.", "Restore or remove it.") from None
    return about_from(value)


def about_from(value: Any) -> About:
    """About, from its plain JSON; what later versions may add is passed over."""
    if not isinstance(value, dict):
        raise refuse("What Touchline wrote about the field is spoilt.", "Export the calibration anew.")
    at = "touchline"
    rotate = value.get("rotate")
    if rotate is not None and (isinstance(rotate, bool) or rotate not in QUARTER_TURNS):
        raise refuse(f"{at}.rotate is none of {', '.join(map(str, QUARTER_TURNS))}.", "Correct it.")
    rectangle = None
    if "rectangle" in value:
        w, h, n_x, n_y = numbers(value["rectangle"], f"{at}.rectangle", (4,))
        rectangle = (w, h, whole(n_x, f"{at}.rectangle[2]", 1, 1000), whole(n_y, f"{at}.rectangle[3]", 1, 1000))
    pose = None
    if "rotation" in value:
        pose = pose_of(numbers(value["rotation"], f"{at}.rotation", (3,)),
                       numbers(entry(value, "position_mm", at), f"{at}.position_mm", (3,)))
    return About(_name(value, "field"), _name(value, "region"), rotate, rectangle, _name(value, "camera"), pose)


def pose_of(rotation: Any, position_mm: Any) -> Pose:
    """A pose above the carpet."""
    pose = Pose(tuple(map(float, rotation)), tuple(map(float, position_mm)))
    number(pose.position_mm[2], "The camera's height", 1e-3)
    number(float(np.linalg.norm(pose.rotation)), "The camera's rotation", 0, 10)
    return pose


def _name(value: dict[str, Any], key: str) -> str | None:
    name = value.get(key)
    if name is None:
        return None
    if not isinstance(name, str) or not NAME.fullmatch(name):
        if key == "camera":
            return None  # cameras may be called what they like elsewhere
        raise refuse(f"touchline.{key} is no name.", "Correct it.")
    return name
