"""A drawn picture of bright bars behind a known lens: edges that are straight in the world and bent in the picture."""

import cv2
import numpy as np

from tests.support.straight_edges import lens_of
from touchline.core.geometry import ImageSize

SIZE = ImageSize(640, 480)
BENT = lens_of("division", (-0.22,), size=SIZE)
STRAIGHT = lens_of("division", (0.0,), size=SIZE)
ROOM = 320  # px of the straight world beyond the picture's end, on each side
BARS = (
    ((-300, 60), (940, 30)),
    ((-300, 170), (940, 200)),
    ((-300, 330), (940, 300)),
    ((-300, 420), (940, 450)),
    ((60, -300), (40, 780)),
    ((220, -300), (250, 780)),
    ((430, -300), (410, 780)),
    ((590, -300), (600, 780)),
)
FINE = 16  # OpenCV's lines know sixteenths of a pixel


def bars_behind(lens=BENT, shade=210):
    """(480, 640, 3) BGR: bars in two directions on a dark ground."""
    world = np.full((SIZE.height + 2 * ROOM, SIZE.width + 2 * ROOM, 3), 45, np.uint8)
    for ends in BARS:
        one, other = ((np.array(end) + ROOM) * FINE for end in ends)
        cv2.line(world, one.tolist(), other.tolist(), (shade,) * 3, 9, cv2.LINE_AA, 4)
    y, x = np.mgrid[: SIZE.height, : SIZE.width].astype(float)
    seen = (lens.undistorted_from_raw(np.stack([x, y], axis=-1)) + ROOM).astype(np.float32)
    return cv2.GaussianBlur(
        cv2.remap(world, seen[..., 0], seen[..., 1], cv2.INTER_CUBIC), (0, 0), 0.7
    )
