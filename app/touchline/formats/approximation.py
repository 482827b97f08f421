"""The camera that a format can hold, its error, and in one line of ours the metadata that it has no place for.

    # touchline: {"field": "ssl-div-b", "region": "full", …}

This line is a comment in YAML and mrcal's files, an entry of its own in JSON. Without it a file is a lens, with it a
calibration.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from touchline.core.errors import Conflict
from touchline.core.field import QUARTER_TURNS, Region
from touchline.core.geometry import as_triple
from touchline.core.records import Calibration
from touchline.evaluate.approximation import (
    ApproximationError,
    approximate_camera,
    approximation_error,
)
from touchline.formats import Format
from touchline.formats.numbers import format_error, integer, number, numbers, require
from touchline.models import CameraModel, Restored
from touchline.models.ray_camera import RayCamera, lens_model

# a lens with fewer terms is preferred unless richer ones are nearer by more than this
NO_WORSE = 1.05
NO_WORSE_MM = 1e-6
# before a lens's all
TERM_LADDER = (("k1", "k2"), ("k1", "k2", "p1", "p2"), ("k1", "k2", "p1", "p2", "k3"))

MARK = re.compile(rb"^# touchline: ([^\r\n]*)", re.MULTILINE)
HEAD_BYTES = 8192
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


@dataclass(frozen=True)
class ExportCamera:
    """The camera to write. loss: of an approximation, else None. camera_id: for formats that number cameras."""

    camera: RayCamera
    loss: ApproximationError | None = None
    camera_id: int | None = None


def export_camera(
    calibration: Calibration, format: Format, approximate: bool, camera_id: int | None = None
) -> ExportCamera:
    """Return the camera as the format can hold it; Conflict where that takes `approximate`."""
    model, field, region = Restored.of(calibration)
    own = exact_camera(model, format.lenses, format.square_pixels)
    if own is not None:
        return ExportCamera(own, None, camera_id)
    if not approximate:
        raise _cannot_hold(model, format)
    camera, loss = nearest_camera(
        model, tuple(format.lenses.items()), format.square_pixels, region, field.hat_height_mm
    )
    return ExportCamera(camera, loss, camera_id)


def exact_camera(
    model: CameraModel, lenses: Mapping[str, tuple[str, ...]], square: bool
) -> RayCamera | None:
    """Return the model as a camera with exactly one of these lenses; None where there is none."""
    if not isinstance(model, RayCamera) or (square and model.aspect != 1):
        return None
    terms = dict(zip(model.LENS.TERMS, model.lens_terms, strict=True))
    if model.NAME in lenses and not any(
        v for name, v in terms.items() if name not in lenses[model.NAME]
    ):
        return model
    plain = next((name for name in lenses if name != "fisheye"), None)
    if plain is None or model.NAME == "fisheye" or any(terms.values()):
        return None
    family = lens_model(plain)  # without distortion, all lenses but the fisheye are one
    return family(
        **{
            **{f.name: getattr(model, f.name) for f in fields(model)},
            "lens_terms": (0.0,) * len(family.LENS.TERMS),
        }
    )


@lru_cache(maxsize=64)
def nearest_camera(
    model: CameraModel,
    lenses: tuple[tuple[str, tuple[str, ...]], ...],
    square: bool,
    region: Region,
    hat_height_mm: float,
) -> tuple[RayCamera, ApproximationError]:
    """Return the nearest camera with one of these lenses and as few terms as suffice, and its error."""
    found = []
    for name, terms in lenses:
        family = lens_model(name)
        for chosen in dict.fromkeys(
            [*(rung for rung in TERM_LADDER if set(rung) < set(terms)), terms]
        ):
            try:
                camera = approximate_camera(
                    model, family, chosen, region, hat_height_mm, square=square
                )
                found.append((camera, approximation_error(model, camera, region, hat_height_mm)))
            except Conflict:
                continue
    if not found:
        raise Conflict(
            "No lens of this format is close to this calibration over its covered area.",
            "Fit brown-conrady to the same points, and export that version.",
            reason="no-approximation",
        )
    best = min(loss.worst_at_any_height_mm for _, loss in found)
    return next(
        (c, loss)
        for c, loss in found
        if loss.worst_at_any_height_mm <= NO_WORSE * best + NO_WORSE_MM
    )


def _cannot_hold(model: CameraModel, format: Format) -> Conflict:
    known = ", ".join(format.lenses)
    if not isinstance(model, RayCamera):
        return Conflict(
            f"{format.title} requires a physical lens model. {model.TITLE} is not one.",
            f"Fit {next(iter(format.lenses))} to the same points, or use approximate=true: the nearest "
            "camera over the covered area, with its error in mm.",
            reason="format-cannot-hold",
        )
    why = (
        "pixels that are not square"
        if format.square_pixels and model.NAME in format.lenses
        else "this lens"
    )
    return Conflict(
        f"{format.title} cannot represent {why} ({model.TITLE}, {', '.join(model.LENS.TERMS)}).",
        f"Fit {known} to the same points, or use approximate=true: the nearest lens over the covered "
        "area, with its error in mm.",
        reason="format-cannot-hold",
    )


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
    # width_px, height_px, n_rectangles_x and _y
    rectangle: tuple[float, float, int, int] | None = None
    camera: str | None = None
    pose: CameraPose | None = None

    @property
    def field_pose(self) -> CameraPose | None:
        """The pose where the field that it refers to is named."""
        return None if self.field is None else self.pose


def metadata_json(calibration: Calibration, export: ExportCamera, *, pose: bool) -> dict[str, Any]:
    """Return the metadata as JSON. pose: include it, for a format that has no place for it."""
    camera = export.camera
    metadata = {
        "field": calibration.field["name"],
        "region": calibration.region,
        "rotate": calibration.rotate,
        "rectangle": [
            camera.width_px,
            camera.height_px,
            camera.n_rectangles_x,
            camera.n_rectangles_y,
        ],
        "camera": calibration.camera,
    }
    if pose:
        metadata |= {"rotation": list(camera.rotation), "position_mm": list(camera.position_mm)}
    if export.loss is not None:
        metadata |= {"approximates": calibration.model_name, "error_mm": export.loss.to_json()}
    return metadata


def header(calibration: Calibration, export: ExportCamera, *words: str, pose: bool) -> str:
    """Return comment lines: what the file is, its approximation error, and the metadata line."""
    lines = ["A camera over a playing field, calibrated by Touchline.", *words]
    if export.loss is not None:
        hat = (
            ""
            if export.loss.hat_worst_mm is None
            else (f", {export.loss.hat_worst_mm:.3f} mm {export.loss.hat_height_mm:g} mm above it")
        )
        lines.append(
            f"Nearest lens of this format to {calibration.model_name}: largest error "
            f"{export.loss.worst_mm:.3f} mm on the carpet, {export.loss.rms_mm:.3f} mm rms{hat}."
        )
    lines.append(
        "touchline: " + json.dumps(metadata_json(calibration, export, pose=pose), allow_nan=False)
    )
    return "".join(f"# {line}\n" for line in lines)


def metadata_from_comment(data: bytes) -> Metadata:
    """Read the metadata line among a file's first lines; BadInput where it is damaged, empty where there is none."""
    found = MARK.search(data[:HEAD_BYTES])
    if found is None:
        return Metadata()
    try:
        value = json.loads(found[1].decode())
    except (ValueError, RecursionError):
        raise format_error(
            "The line that begins with # touchline: is damaged.", "Restore or remove it."
        ) from None
    return metadata_from_json(value)


def metadata_from_json(value: Any) -> Metadata:
    """Read metadata from JSON; unknown entries, of later versions, are ignored."""
    if not isinstance(value, dict):
        raise format_error(
            "The field data that Touchline wrote is damaged.", "Export the calibration again."
        )
    at = "touchline"
    rotate = value.get("rotate")
    if rotate is not None and (isinstance(rotate, bool) or rotate not in QUARTER_TURNS):
        raise format_error(
            f"{at}.rotate is not one of {', '.join(map(str, QUARTER_TURNS))}.", "Correct it."
        )
    rectangle = None
    if "rectangle" in value:
        w, h, n_x, n_y = numbers(value["rectangle"], f"{at}.rectangle", (4,))
        rectangle = (
            w,
            h,
            integer(n_x, f"{at}.rectangle[2]", 1, 1000),
            integer(n_y, f"{at}.rectangle[3]", 1, 1000),
        )
    pose = None
    if "rotation" in value:
        pose = checked_pose(
            numbers(value["rotation"], f"{at}.rotation", (3,)),
            numbers(require(value, "position_mm", at), f"{at}.position_mm", (3,)),
        )
    return Metadata(
        _name(value, "field"),
        _name(value, "region"),
        rotate,
        rectangle,
        _name(value, "camera"),
        pose,
    )


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
