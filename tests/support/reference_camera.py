"""The camera and the 4 × 3 m field on which methods are compared and whose figures the manual quotes.

1280 × 1024 px, focal length 700 px, 4.15 m above the middle. It is tilted where it stands, mostly up the picture and
partly to the side, as a camera on a loose ball head is; so the field leaves the middle of the picture.
"""

import numpy as np

from touchline.core.field import Field, Line, Region
from touchline.core.geometry import ImageSize
from touchline.sources.sim.camera import LENSES, Lens, SimCamera

SIZE = ImageSize(1280, 1024)
FOCAL_PX = 720.0
HEIGHT_MM = 4150.0
# of the tilt's axis from the picture's x; at 0 or 90 one direction alone would shrink
TILT_AZIMUTH_DEG = 25.0


def reference_field() -> Field:
    """4000 × 3000 mm, its four borders, and nothing else painted on it."""
    x, y = 2000.0, 1500.0
    ring = {
        "touch-line-top": ((-x, y), (x, y)),
        "touch-line-bottom": ((-x, -y), (x, -y)),
        "goal-line-left": ((-x, -y), (-x, y)),
        "goal-line-right": ((x, -y), (x, y)),
    }
    return Field(
        "reference",
        "Reference, 4 × 3 m",
        2 * x,
        2 * y,
        lines={name: Line(name, *ends) for name, ends in ring.items()},
        arcs={},
        landmarks={},
        regions={"full": Region("full", (-x, x), (-y, y))},
        line_sigma_mm=0.0,
    )


def reference_camera(
    lens: str | Lens = "strong", tilt_deg: float = 0.0, height_mm: float = HEIGHT_MM
) -> SimCamera:
    """The reference camera with another lens, by name or as it is, and another tilt."""
    azimuth = np.radians(TILT_AZIMUTH_DEG)
    return SimCamera.above(
        reference_field().regions["full"],
        SIZE,
        LENSES[lens] if isinstance(lens, str) else lens,
        height_mm=height_mm,
        tilt_deg=tilt_deg * float(np.cos(azimuth)),
        pan_deg=tilt_deg * float(np.sin(azimuth)),
        focal_px=FOCAL_PX,
        stand_mm=(0.0, 0.0),
    )
