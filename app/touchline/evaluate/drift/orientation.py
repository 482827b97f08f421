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
BEYOND = 0.35  # of the region's sides, to either side: walls and benches tell most
SMOOTH = 4.0  # places: wider brightness is light, which changes
CLIPPED = 3.0  # spreads: a robot counts no more than a stain
SURE, CONTRARY = 0.4, -0.3  # correlation; robots that moved gave -0.11 to 0.3
MIN_PLACES = 400
WIDTH_PX = 320  # of the picture that is looked at
TINY_LEVELS = 0.3  # grey levels: less is noise

Way = Literal["turned", "mirrored"]
State = Literal["confirmed", "contradicted", "unknown"]
SAID: dict[Way, Sentence] = {
    "turned": say("orientation.turned", "The image is turned by 180° against the calibration image: the lines match, "
                                        "but what is between and around them is on the other side."),
    "mirrored": say("orientation.mirrored", "The image is mirrored against the calibration image: the lines match, "
                                            "but what is between and around them is on the other side.")}
FIX = say("orientation.fix", "Turn the camera back, or switch off the mirroring. If it is to stay like this, calibrate "
                             "it again from the current image.")
FLIPS: dict[str, tuple[Way, tuple[int, int]]] = {
    "turned": ("turned", (-1, -1)), "along-x": ("mirrored", (-1, 1)), "along-y": ("mirrored", (1, -1))}


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
        """picture (h, w[, 3]), as seen by the model."""
        (x0, x1), (y0, y1) = region.x_mm, region.y_mm
        more = 1 + 2 * BEYOND
        x, y = ((a + b) / 2 + (b - a) / 2 * more * np.linspace(-1, 1, count)
                for a, b, count in ((x0, x1, COLUMNS), (y0, y1, ROWS)))
        places = np.stack(np.meshgrid(x, y), axis=-1)
        return cls(places, _levels(picture, model, places))

    def compare(self, picture: Pixels, model: CameraModel) -> Orientation:
        """Compare a picture (h, w[, 3]) of the same camera, as seen by its model now."""
        now = _levels(picture, model, self.places)
        likeness = {name: found for name, (_, signs) in FLIPS.items()
                    if (found := _likeness(_odd(self.levels, signs), _odd(now, signs))) is not None}
        worst = min(likeness, key=lambda name: likeness[name], default=None)
        if worst is not None and likeness[worst] < CONTRARY:
            return Orientation("contradicted", FLIPS[worst][0], likeness)
        sure = len(likeness) == len(FLIPS) and min(likeness.values()) > SURE
        return Orientation("confirmed" if sure else "unknown", None, likeness)


def _levels(picture: Pixels, model: CameraModel, places: Points) -> Array:
    """Return the grey level about each place, without what is as wide as light is; NaN outside the picture."""
    gray = opencv.to_grey(opencv.shrink_to_width(picture, WIDTH_PX)).astype(np.float32)
    scale = gray.shape[1] / picture.shape[1]
    at = ((raw_from_field(model, places) + 0.5) * scale - 0.5).astype(np.float32)
    at = np.where(np.isfinite(at), at, -1e4)
    levels = cv2.remap(gray, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
                       borderValue=float("nan"))
    known = np.isfinite(levels).astype(np.float32)
    wide = cv2.GaussianBlur(np.nan_to_num(levels), (0, 0), SMOOTH) / np.maximum(
        cv2.GaussianBlur(known, (0, 0), SMOOTH), 1e-3)
    return np.where(known > 0, levels - wide, np.nan).astype(np.float64)


def _odd(levels: Array, signs: tuple[int, int]) -> Array:
    return levels - levels[::signs[1], ::signs[0]]


def _likeness(then: Array, now: Array) -> float | None:
    """Return the correlation of what is asymmetric; None where that is too little."""
    known = np.isfinite(then) & np.isfinite(now)
    if known.sum() < MIN_PLACES:
        return None
    values = []
    for levels in (then[known], now[known]):
        spread = 1.4826 * float(np.median(np.abs(levels)))
        if spread < TINY_LEVELS:
            return None
        values.append(np.clip(levels / spread, -CLIPPED, CLIPPED))
    return float(np.sum(values[0] * values[1]) / np.sqrt(np.sum(values[0] ** 2) * np.sum(values[1] ** 2)))
