"""Whether a picture shows the field the same way round as the picture that a calibration came from.

Lines cannot tell: a whole field turned by half a turn, or mirrored, has the same ones. What lies between and about them
can. Both pictures I are looked at from above, and of each only what its turned or mirrored self T I differs by counts:

    A I = I − T I,   so that A T I = −A I        T: half a turn, or a mirror along x or y

Where T leaves the lines as they are, they are gone from it, and so is what shines evenly. The correlation of A I then
with A I now is near 1 where nothing has changed, near −1 where the picture was turned that way, and near 0 where
nothing asymmetric is in it, or only robots that have moved.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple, Self

import cv2
import numpy as np

from touchline.core import opencv
from touchline.core.field import Region
from touchline.core.geometry import Array, Pixels, Points
from touchline.core.statements import Sentence, say
from touchline.models import CameraModel, raw_from_field

COLUMNS, ROWS = 96, 72  # places over the region and its surroundings
SURROUNDINGS = 0.35  # of the region's sides, to either side: walls and benches tell most
LIGHT_SIGMA = 4.0  # places: what is wider than that is light, which changes
MAX_SPREADS = 3.0  # a robot counts no more than a stain
MIN_SAME, MAX_OPPOSITE = 0.4, -0.3  # correlation; robots that moved gave -0.11 to 0.3
MIN_PLACES = 400
WIDTH_PX = 320  # of the picture that is looked at
MIN_SPREAD_LEVELS = 0.3  # grey levels: less is noise
SIGMA_PER_MEDIAN = 1.4826  # of the size of a normal error
BEYOND_IMAGE_PX = -1e4  # where a place is that the model does not reach

Way = Literal["turned", "mirrored"]
State = Literal["confirmed", "contradicted", "unknown"]
SENTENCES: dict[Way, Sentence] = {
    "turned": say(
        "orientation.turned",
        "The image is turned by 180° against the calibration image: the lines match, "
        "but what is between and around them is on the other side.",
    ),
    "mirrored": say(
        "orientation.mirrored",
        "The image is mirrored against the calibration image: the lines match, "
        "but what is between and around them is on the other side.",
    ),
}
FIX = say(
    "orientation.fix",
    "Turn the camera back, or switch off the mirroring. If the image is to stay like this, use Turn… at the "
    "version where only the image was turned; otherwise calibrate the camera again from the current image.",
)
FLIPS: dict[str, tuple[Way, tuple[int, int]]] = {
    "turned": ("turned", (-1, -1)),
    "along-x": ("mirrored", (-1, 1)),
    "along-y": ("mirrored", (1, -1)),
}


class Orientation(NamedTuple):
    """way: how it was turned, None unless that is contradicted. likeness: by transformation, where it is known."""

    state: State
    way: Way | None
    likeness: dict[str, float]


UNKNOWN = Orientation("unknown", None, {})


@dataclass(frozen=True, eq=False)
class OrientationReference:
    """What is asymmetric in a picture: levels (rows, columns) about places (rows, columns, 2) mm over a region."""

    places: Points
    levels: Array

    @classmethod
    def of(cls, picture: Pixels, model: CameraModel, region: Region) -> Self:
        """Sample a picture (h, w[, 3]) of that camera over the region and its surroundings."""
        (x0, x1), (y0, y1) = region.x_mm, region.y_mm
        factor = 1 + 2 * SURROUNDINGS
        x, y = (
            (a + b) / 2 + (b - a) / 2 * factor * np.linspace(-1, 1, count)
            for a, b, count in ((x0, x1, COLUMNS), (y0, y1, ROWS))
        )
        places = np.stack(np.meshgrid(x, y), axis=-1)
        return cls(places, _levels(picture, model, places))

    def compare(self, picture: Pixels, model: CameraModel) -> Orientation:
        """Compare a picture (h, w[, 3]) of the same camera, as seen by its model now."""
        now = _levels(picture, model, self.places)
        likeness = {
            name: found
            for name, (_, signs) in FLIPS.items()
            if (found := _likeness(_asymmetric(self.levels, signs), _asymmetric(now, signs)))
            is not None
        }
        worst = min(likeness, key=lambda name: likeness[name], default=None)
        if worst is not None and likeness[worst] < MAX_OPPOSITE:
            return Orientation("contradicted", FLIPS[worst][0], likeness)
        is_sure = len(likeness) == len(FLIPS) and min(likeness.values()) > MIN_SAME
        return Orientation("confirmed" if is_sure else "unknown", None, likeness)


def _levels(picture: Pixels, model: CameraModel, places: Points) -> Array:
    """Return the grey level about each place, without what is as wide as light is; NaN outside the picture."""
    gray = opencv.to_grey(opencv.shrink_to_width(picture, WIDTH_PX)).astype(np.float32)
    scale = gray.shape[1] / picture.shape[1]
    at = ((raw_from_field(model, places) + 0.5) * scale - 0.5).astype(np.float32)
    at = np.where(np.isfinite(at), at, BEYOND_IMAGE_PX)
    levels = cv2.remap(
        gray,
        at[..., 0],
        at[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=float("nan"),
    )
    known = np.isfinite(levels).astype(np.float32)
    # The mean of the known places about each one: blurred levels over blurred ones and noughts.
    light = cv2.GaussianBlur(np.nan_to_num(levels), (0, 0), LIGHT_SIGMA) / np.maximum(
        cv2.GaussianBlur(known, (0, 0), LIGHT_SIGMA), 1e-3
    )
    return np.where(known > 0, levels - light, np.nan).astype(np.float64)


def _asymmetric(levels: Array, signs: tuple[int, int]) -> Array:
    """Return A I: what remains of levels without their turned or mirrored self. signs: steps along x and y."""
    return levels - levels[:: signs[1], :: signs[0]]


def _likeness(then: Array, now: Array) -> float | None:
    """Return the correlation of what is asymmetric; None where that is too little."""
    known = np.isfinite(then) & np.isfinite(now)
    if known.sum() < MIN_PLACES:
        return None
    clipped = []
    for levels in (then[known], now[known]):
        spread = SIGMA_PER_MEDIAN * float(np.median(np.abs(levels)))
        if spread < MIN_SPREAD_LEVELS:
            return None
        clipped.append(np.clip(levels / spread, -MAX_SPREADS, MAX_SPREADS))
    one, other = clipped
    return float(np.sum(one * other) / np.sqrt(np.sum(one**2) * np.sum(other**2)))
