"""A map of millimetres as a picture: colours, a scale with units, and the worst place marked."""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv

SHADES = 256
BAR_PX, MARGIN_PX, LABEL_PX = 18, 14, 64
# mm, of every map: where good and usable end, so that a colour always means the same
TICKS = (0.0, 5.0, 15.0)
Colour = tuple[int, int, int]
INK, PAPER = BRIGHT, DARK = (230, 236, 233), (28, 23, 20)


def heat_map(
    values: NDArray[np.float64],
    *,
    width: int,
    height: int,
    unit: str,
    title: str,
    ink: Colour = INK,
    paper: Colour = PAPER,
) -> NDArray[np.uint8]:
    """Draw values (rows, columns) over a rectangle of width × height px, with its scale at its right.

    NaN is left as paper, and more than the scale's end has its colour. ink, paper: BGR.
    """
    known = values[np.isfinite(values)]
    largest = float(known.max()) if known.size else 1.0
    end = TICKS[-1]
    field = opencv.resize_grid(np.where(np.isfinite(values), values, np.nan), width, height)
    picture = np.full(
        (height + 2 * MARGIN_PX + 16, width + 3 * MARGIN_PX + BAR_PX + LABEL_PX, 3), paper, np.uint8
    )
    shades = opencv.viridis()
    index = np.clip(np.nan_to_num(field) / end * (SHADES - 1), 0, SHADES - 1).astype(int)
    inside = shades[index]
    inside[~np.isfinite(field)] = paper
    y0, x0 = MARGIN_PX + 16, MARGIN_PX
    picture[y0 : y0 + height, x0 : x0 + width] = inside
    bar_x = x0 + width + MARGIN_PX
    ramp = shades[np.linspace(SHADES - 1, 0, height).astype(int)]
    picture[y0 : y0 + height, bar_x : bar_x + BAR_PX] = ramp[:, None]
    for tick in TICKS:
        opencv.draw_text(
            picture,
            f"{tick:g} {unit}",
            (bar_x + BAR_PX + 5, int(y0 + height * (1 - tick / end)) + 4),
            ink,
        )
    opencv.draw_text(picture, title, (x0, MARGIN_PX + 4), ink)
    if known.size:
        row, column = np.unravel_index(np.nanargmax(values), values.shape)
        rows, columns = values.shape
        x = x0 + column / max(columns - 1, 1) * (width - 1)
        y = y0 + row / max(rows - 1, 1) * (height - 1)
        at = shades[int(np.clip(largest / end * (SHADES - 1), 0, SHADES - 1))]
        ink = BRIGHT if at.mean() < 128 else DARK  # to be seen on the colour of that place
        cv2.circle(picture, (int(x), int(y)), 7, ink, 1, cv2.LINE_AA)
        cv2.drawMarker(picture, (int(x), int(y)), ink, cv2.MARKER_CROSS, 7, 1, cv2.LINE_AA)
        opencv.draw_text(
            picture,
            f"{largest:.2g} {unit}",
            (
                int(min(max(x - 20, x0 + 2), x0 + width - 60)),
                int(y + (18 if y < y0 + height / 2 else -12)),
            ),
            ink,
        )
    return picture
