"""What a field is made of, as JSON; mm, and degrees counter-clockwise."""

from typing import Any

from typing_extensions import TypedDict

from touchline.core.json_values import PointJson
from touchline.core.statements import Stated

LineJson = TypedDict("LineJson", {"name": str, "from": PointJson, "to": PointJson, "width_mm": float})


class ArcJson(TypedDict):
    name: str
    centre: PointJson
    radius_mm: float
    start_deg: float
    end_deg: float
    width_mm: float


class RegionJson(TypedDict):
    """x, y: its smallest and largest mm; width_mm, height_mm: as it stands in the corrected picture."""

    name: str
    x: PointJson
    y: PointJson
    rotate: int
    width_mm: float
    height_mm: float
    left: LineJson
    right: LineJson
    top: LineJson
    bottom: LineJson


class FieldJson(Stated):
    name: str
    title: str
    length_mm: float
    width_mm: float
    lines: list[LineJson]
    arcs: list[ArcJson]
    landmarks: dict[str, PointJson]
    regions: dict[str, RegionJson]
    hat_height_mm: float
    line_sigma_mm: float
    extras: dict[str, Any]
