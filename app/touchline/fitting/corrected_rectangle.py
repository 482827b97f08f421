"""The corrected rectangle: I_width and I_height from the rig's rectangles, Eq. (3) and (7)."""

from collections.abc import Mapping
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import ImageSize
from touchline.core.options import Option

DEFAULT_RECTANGLES = 10  # between the far apart borders, unless the rig says otherwise
MAX_CORRECTED_PX = 50e6

RECTANGLE_OPTIONS: tuple[Option, ...] = (
    Option("w_max_rectangle_px", "float", None,
           "Width of the widest calibration rectangle; the same for all cameras of a rig. Empty: from the field and "
           "the image.",
           (1, 10_000), "px"),
    Option("h_max_rectangle_px", "float", None, "Height of the highest calibration rectangle.", (1, 10_000), "px"),
    Option("n_rectangles_x", "int", None, "Rectangles between the left and the right border.", (1, 1000)),
    Option("n_rectangles_y", "int", None, "Rectangles between the top and the bottom border.", (1, 1000)),
)


def corrected_rectangle(settings: Mapping[str, Any], region: Region,
                        image_size: ImageSize) -> tuple[float, float, int, int]:
    """Return I_width and I_height with their numbers of rectangles, Eq. (3) and (7).

    Defaults depend on the field and the picture size alone, never on the clicks, so that cameras of one rig agree:
    the region, square-pixelled, as large as fits into the picture.
    """
    longer = max(region.width_mm, region.height_mm)
    n_x = settings["n_rectangles_x"] or max(1, round(DEFAULT_RECTANGLES * region.width_mm / longer))
    n_y = settings["n_rectangles_y"] or max(1, round(DEFAULT_RECTANGLES * region.height_mm / longer))
    px_per_mm = min(image_size.width / region.width_mm, image_size.height / region.height_mm)
    w_max, h_max = settings["w_max_rectangle_px"], settings["h_max_rectangle_px"]
    width = w_max * n_x if w_max else round(region.width_mm * px_per_mm)  # Eq. (3)
    height = h_max * n_y if h_max else round(region.height_mm * px_per_mm)  # Eq. (7)
    if width < 16 or height < 16 or width > 16000 or height > 16000 or width * height > MAX_CORRECTED_PX:
        raise BadInput(f"The corrected image would be {width:.0f} × {height:.0f} px.",
                       "Choose sizes and numbers of rectangles that result in 16 to 16 000 px per side and at most 50 "
                       "megapixels.",
                       reason="bad-corrected-size")
    return float(width), float(height), n_x, n_y
