"""vision-processor's config.yml: the start of its own calibration, four corners in a picture and the camera's height.

line_corners are pixels of the corners of the camera's area: first the one with the smallest x and y, the others in any
order. cam_id and camera_amount state which area: the field is halved across its longer side until there are as many.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml

from touchline.core.errors import Conflict
from touchline.core.field import QUARTER_TURNS, Field, Region
from touchline.core.geometry import Array, ImageSize
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Observation, Observations
from touchline.formats import Format
from touchline.formats.document import parse
from touchline.formats.numbers import checked_size, format_error, integer, number, numbers
from touchline.models import Restored, raw_from_field
from touchline.models.ray_camera import RayCamera

MAX_CAMERAS = 8
SAME_MM = 1.0
HALVES_PICTURES = (
    "SPINNAKER",
    "MVIMPACT",
)  # drivers whose corners may be of pictures of half the size


@dataclass(frozen=True)
class AreaCorners:
    """corners_px (4, 2): in the picture, clockwise from the one with the smallest x and y of the field.

    height_mm: of the camera; None where it is to be found. image_size: None where the file does not tell.
    """

    camera_id: int
    cameras: int
    corners_px: tuple[tuple[float, float], ...]
    height_mm: float | None
    image_size: ImageSize | None

    def region(self, field: Field) -> Region:
        """Return the field's region that is this camera's area, as it is seen; Conflict where the field has none."""
        x_mm, y_mm = area_mm(field, self.camera_id, self.cameras)
        for region in field.regions.values():
            if np.allclose((region.x_mm, region.y_mm), (x_mm, y_mm), atol=SAME_MM):
                return _upright(region, self.corners_px)
        raise Conflict(
            f"The field has no area from x {x_mm[0]:g} to {x_mm[1]:g} and y {y_mm[0]:g} to {y_mm[1]:g} mm.",
            "Add it to the field, or enter another: region.",
            reason="unknown-region",
        )

    def observations(self, region: Region) -> Observations:
        return tuple(
            Observation(place, "landmark", np.array([pixel]))
            for place, pixel in zip(_corners_mm(region), self.corners_px, strict=True)
        )


def _upright(region: Region, corners_px: Sequence[tuple[float, float]]) -> Region:
    """Return the region turned so that its top border runs to the picture's right."""
    corners_mm = np.array(_corners_mm(region))

    def runs_right(turned: Region) -> float:
        top = turned.border("top")
        nearest = (
            int(np.abs(corners_mm - end).sum(axis=1).argmin()) for end in (top.start, top.end)
        )
        start, end = (corners_px[i][0] for i in nearest)
        return end - start

    return max((region.rotated(turn) for turn in QUARTER_TURNS), key=runs_right)


def area_mm(
    field: Field, camera_id: int, cameras: int
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return x and y from least to greatest of the area of this camera of so many, a power of two."""
    columns = rows = 1
    while columns * rows < cameras:
        if field.length_mm / columns >= field.width_mm / rows:
            columns *= 2
        else:
            rows *= 2
    column, row = divmod(camera_id % cameras, rows)
    width, height = field.length_mm / columns, field.width_mm / rows
    x, y = column * width - field.length_mm / 2, row * height - field.width_mm / 2
    return (x, x + width), (y, y + height)


def _corners_mm(region: Region) -> list[tuple[float, float]]:
    """Return an area's corners, clockwise as a camera above sees them, from the one with the smallest x and y."""
    (x0, x1), (y0, y1) = region.x_mm, region.y_mm
    return [(x0, y0), (x0, y1), (x1, y1), (x1, y0)]


def recognises(data: bytes) -> bool:
    return b"line_corners" in data and b"geometry" in data


def read(data: bytes) -> AreaCorners:
    """Read the corners; BadInput where there are none."""
    content = parse(data).first
    stated = content.get("geometry")
    corners = stated.get("line_corners") if isinstance(stated, dict) else None
    if not isinstance(stated, dict) or not isinstance(corners, list) or len(corners) != 4:
        raise format_error(
            "The file has no four line_corners.",
            "Enter them in config.yml, or find the lines here.",
        )
    pixels = [
        numbers(corner, f"geometry.line_corners[{i}]", (2,)) for i, corner in enumerate(corners)
    ]
    cameras = integer(stated.get("camera_amount", "1"), "geometry.camera_amount", 1, MAX_CAMERAS)
    if cameras & (cameras - 1):
        raise format_error(f"geometry.camera_amount is {cameras}.", "Use 1, 2, 4 or 8.")
    height = number(stated.get("camera_height", "0"), "geometry.camera_height", 0, 1e6)
    return AreaCorners(
        integer(content.get("cam_id", "0"), "cam_id", 0, MAX_CAMERAS - 1),
        cameras,
        _clockwise(pixels),
        height or None,
        _size(content.get("camera")),
    )


def _clockwise(pixels: list[tuple[float, ...]]) -> tuple[tuple[float, float], ...]:
    """Return the first corner and then the others as they follow clockwise in the picture, whose y runs down."""
    points = np.array(pixels)
    from_middle = points - points.mean(axis=0)
    angle = np.arctan2(from_middle[:, 1], from_middle[:, 0])
    order = np.argsort((angle - angle[0]) % (2 * np.pi))
    return tuple((float(x), float(y)) for x, y in points[order])


def _size(camera: Any) -> ImageSize | None:
    """Return the size of the pictures; None where it may be half of what the camera is set to."""
    if not isinstance(camera, dict) or camera.get("driver") in (None, *HALVES_PICTURES):
        return None
    sides = [str(camera.get(side, "0")) for side in ("width", "height")]
    return None if "0" in sides else checked_size(*sides)


def write(calibration: Calibration, _: Progress = no_progress) -> bytes:
    """Return what a config.yml needs of this camera; Conflict for an area that vision-processor has not."""
    model, field, region = Restored.of(calibration)
    camera_id, cameras = _camera_id(field, region)
    pixels: Array = raw_from_field(model, np.array(_corners_mm(region)))
    if not np.isfinite(pixels).all():
        raise Conflict(
            "A corner of the covered area is not in reach of the calibration.",
            "Calibrate with a physical lens model.",
            reason="format-cannot-hold",
        )
    stated: JsonObject = {"camera_amount": cameras}
    if isinstance(model, RayCamera):
        stated["camera_height"] = round(model.position_mm[2], 1)
    stated["line_corners"] = [[round(float(v), 1) for v in pixel] for pixel in pixels]
    return yaml.safe_dump(
        {"cam_id": camera_id, "geometry": stated}, sort_keys=False, default_flow_style=None
    ).encode()


def _camera_id(field: Field, region: Region) -> tuple[int, int]:
    """Return the camera's number, and of how many."""
    for cameras in (1, 2, 4, 8):
        for camera_id in range(cameras):
            area = area_mm(field, camera_id, cameras)
            if np.allclose(area, (region.x_mm, region.y_mm), atol=SAME_MM):
                return camera_id, cameras
    raise Conflict(
        f"vision-processor does not divide a field into areas such as {region.name}.",
        "Export the calibration as vision-processor, which takes it as it is.",
        reason="format-cannot-hold",
    )


FORMAT = Format(
    "vision-processor config",
    "application/yaml",
    ".config.yml",
    "Camera number, height and corners, with which vision-processor starts its own calibration.",
    write,
    read,
    recognises,
)
