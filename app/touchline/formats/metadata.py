"""Metadata that other formats have no place for, in one line of ours: field, region, how it is drawn, and the pose
where the format cannot hold it.

    # touchline: {"field": "ssl-div-b", "region": "full", …}

A comment in YAML and mrcal's files, an entry of its own in JSON. Without it a file is a lens, with it a calibration.
"""

import json
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.core.field import QUARTER_TURNS
from touchline.core.geometry import as_triple
from touchline.core.records import Calibration
from touchline.formats.approximation import ExportCamera
from touchline.formats.numbers import format_error, integer, number, numbers, require

MARK = re.compile(rb"^# touchline: ([^\r\n]*)", re.MULTILINE)
HEAD_BYTES = 8192
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class CameraPose:
    """rotation: camera_from_field as a rotation vector; position_mm: the centre of projection in the field."""

    rotation: tuple[float, float, float]
    position_mm: tuple[float, float, float]


@dataclass(frozen=True)
class Metadata:
    """The field that a file's camera belongs to; all None in a file of another program."""

    field: str | None = None
    region: str | None = None
    rotate: int | None = None
    rectangle: tuple[float, float, int, int] | None = None  # width_px, height_px, n_rectangles_x and _y
    camera: str | None = None
    pose: CameraPose | None = None

    @property
    def field_pose(self) -> CameraPose | None:
        """The pose where the field that it refers to is named."""
        return None if self.field is None else self.pose


def metadata_json(calibration: Calibration, export: ExportCamera, *, pose: bool) -> dict[str, Any]:
    """Return the metadata as JSON. pose: include it, for a format that has no place for it."""
    camera = export.camera
    metadata = {"field": calibration.field["name"], "region": calibration.region, "rotate": calibration.rotate,
                "rectangle": [camera.width_px, camera.height_px, camera.n_rectangles_x, camera.n_rectangles_y],
                "camera": calibration.camera}
    if pose:
        metadata |= {"rotation": list(camera.rotation), "position_mm": list(camera.position_mm)}
    if export.loss is not None:
        metadata |= {"approximates": calibration.model_name, "error_mm": export.loss.to_json()}
    return metadata


def header(calibration: Calibration, export: ExportCamera, *words: str, pose: bool) -> str:
    """Return comment lines: what the file is, its approximation error, and the metadata line."""
    lines = ["A camera over a playing field, calibrated by Touchline.", *words]
    if export.loss is not None:
        hat = "" if export.loss.hat_worst_mm is None else (
            f", {export.loss.hat_worst_mm:.3f} mm {export.loss.hat_height_mm:g} mm above it")
        lines.append(f"Nearest lens of this format to {calibration.model_name}: largest error "
                     f"{export.loss.worst_mm:.3f} mm on the carpet, {export.loss.rms_mm:.3f} mm rms{hat}.")
    lines.append("touchline: " + json.dumps(metadata_json(calibration, export, pose=pose), allow_nan=False))
    return "".join(f"# {line}\n" for line in lines)


def metadata_from_comment(data: bytes) -> Metadata:
    """Read the metadata line among a file's first lines; BadInput where it is damaged, empty where there is none."""
    found = MARK.search(data[:HEAD_BYTES])
    if found is None:
        return Metadata()
    try:
        value = json.loads(found[1].decode())
    except (ValueError, RecursionError):
        raise format_error("The line that begins with # touchline: is damaged.", "Restore or remove it.") from None
    return metadata_from_json(value)


def metadata_from_json(value: Any) -> Metadata:
    """Read metadata from JSON; unknown entries, of later versions, are ignored."""
    if not isinstance(value, dict):
        raise format_error("The field data that Touchline wrote is damaged.", "Export the calibration again.")
    at = "touchline"
    rotate = value.get("rotate")
    if rotate is not None and (isinstance(rotate, bool) or rotate not in QUARTER_TURNS):
        raise format_error(f"{at}.rotate is not one of {', '.join(map(str, QUARTER_TURNS))}.", "Correct it.")
    rectangle = None
    if "rectangle" in value:
        w, h, n_x, n_y = numbers(value["rectangle"], f"{at}.rectangle", (4,))
        rectangle = (w, h, integer(n_x, f"{at}.rectangle[2]", 1, 1000), integer(n_y, f"{at}.rectangle[3]", 1, 1000))
    pose = None
    if "rotation" in value:
        pose = checked_pose(numbers(value["rotation"], f"{at}.rotation", (3,)),
                            numbers(require(value, "position_mm", at), f"{at}.position_mm", (3,)))
    return Metadata(_name(value, "field"), _name(value, "region"), rotate, rectangle, _name(value, "camera"), pose)


def checked_pose(rotation: Any, position_mm: Any) -> CameraPose:
    """Return a pose above the carpet."""
    pose = CameraPose(as_triple(rotation), as_triple(position_mm))
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
        raise format_error(f"touchline.{key} is not a name.", "Correct it.")
    return name
