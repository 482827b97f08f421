"""The conventions of all packages: frames, units, the pixel origin, and the NaN rule.

Frames
    raw         pixels of the picture as it came from the camera
    corrected   pixels of the corrected picture, straight borders; column 0 is the left border
    region      (u, v) mm from the region's top-left corner, u right and v down, as it stands in
                the corrected picture
    field       (x, y) mm from the field's centre, x goal to goal, y to the left of x, z up

Pixels are floats. (0, 0) is the *centre* of the top-left pixel; x goes right and y goes down. A picture
of width w therefore covers x from -0.5 to w - 0.5, and scaling it by s maps x to s (x + 0.5) - 0.5.

Functions are named target_from_source: corrected = model.corrected_from_raw(raw).

Points are arrays (..., 2), x before y; leading axes are anybody's and are kept. A point that a
mapping cannot reach is NaN in both coordinates, never a guess; NaN in gives NaN out. At every border
of the program non-finite input is refused, because one infinity hangs numpy's SVD.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.json_values import in_words

Array = NDArray[np.float64]
Points = NDArray[np.float64]  # (..., 2)
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]
Pixels = NDArray[np.uint8]  # (h, w) grey, (h, w, 3) BGR

# Nothing on a picture or a playing field is larger; beyond it, squares and cubes of coordinates
# lose the digits that a least squares needs, and 1e308 overflows.
MAX_COORDINATE = 1e7
MIN_SIDE_PX, MAX_SIDE_PX = 2, 65_536  # of a picture that can be calibrated
MAX_MATCHES = 20_000
MAX_PICTURE_PX = 200_000_000  # the largest sensors have 150 million pixels


@dataclass(frozen=True)
class ImageSize:
    """Width and height of a picture, px."""

    width: int
    height: int

    def __iter__(self) -> Iterator[int]:
        return iter((self.width, self.height))

    def __str__(self) -> str:
        return f"{self.width} × {self.height} px"

    @classmethod
    def of(cls, value: Any) -> "ImageSize":
        """Read an ImageSize from (width, height); refuse what no camera delivers."""
        try:
            width, height = (int(v) for v in value)
        except (TypeError, ValueError, OverflowError):
            raise BadInput(
                f"An image size cannot be {in_words(value)}.",
                "Give it as [width, height] in pixels.",
                reason="bad-image-size",
            ) from None
        if not all(MIN_SIDE_PX <= side <= MAX_SIDE_PX for side in (width, height)):
            raise BadInput(
                f"An image of {width} × {height} px cannot be calibrated.",
                f"Give a width and a height between {MIN_SIDE_PX} and {MAX_SIDE_PX} pixels.",
                reason="bad-image-size",
            )
        if width * height > MAX_PICTURE_PX:
            raise BadInput(
                f"An image of {width} × {height} px cannot be calibrated.",
                f"Give a size of at most {MAX_PICTURE_PX // 10**6} million pixels.",
                reason="bad-image-size",
            )
        return cls(width, height)

    @property
    def centre(self) -> tuple[float, float]:
        return (self.width - 1) / 2, (self.height - 1) / 2


def as_points(value: Any, what: str = "The points") -> Points:
    """Turn anything point-like into a fresh float64 array (..., 2); refuse NaN, infinities and giants.

    what: how the error calls them, such as "The left border's points".
    """
    try:
        points = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(
            f"{what} are not pairs of numbers.", "Send them as [[x, y], …].", reason="bad-points"
        ) from None
    if points.size == 0:
        return points.reshape(0, 2)
    if points.ndim < 1 or points.shape[-1] != 2:
        raise BadInput(
            f"{what} are not pairs of numbers.", "Send them as [[x, y], …].", reason="bad-points"
        )
    flat = points.reshape(-1, 2)
    # catches NaN and inf as well
    bad = np.flatnonzero(~(np.abs(flat) <= MAX_COORDINATE).all(axis=1))
    if bad.size:
        raise BadInput(
            f"{what} contain a number that is not finite or beyond {MAX_COORDINATE:g} (point {bad[0] + 1}).",
            "Remove or correct that point.",
            reason="non-finite-points",
            index=int(bad[0]),
        )
    return points


def as_matches(a: Points, b: Points) -> tuple[Points, Points]:
    """Return both as (n, 2), finite, and as many; BadInput otherwise."""
    a = as_points(a, "The points of the first view").reshape(-1, 2)
    b = as_points(b, "The points of the second view").reshape(-1, 2)
    if len(a) != len(b):
        raise BadInput(
            f"The first view has {len(a)} points and the second {len(b)}.",
            "Send matches: as many points in both, in the same order.",
            reason="bad-matches",
        )
    if len(a) > MAX_MATCHES:
        raise BadInput(
            f"{len(a)} matches were sent; at most {MAX_MATCHES} are possible.",
            "Send fewer matches.",
            reason="too-many-points",
        )
    return a, b


def as_pair(value: Iterable[Any]) -> tuple[float, float]:
    """Read two numbers; TypeError or ValueError for anything else."""
    a, b = value
    return float(a), float(b)


def as_triple(value: Iterable[Any]) -> tuple[float, float, float]:
    """Read three numbers; TypeError or ValueError for anything else."""
    a, b, c = value
    return float(a), float(b), float(c)


def inside_picture(
    raw: Points | NDArray[np.float32], size: ImageSize, margin_px: float | Array = -0.5
) -> Mask:
    """(...,) whether raw px (..., 2) lie in a picture, at least margin_px from its outermost pixels' centres."""
    with np.errstate(invalid="ignore"):
        return np.all((raw >= margin_px) & (raw <= np.array(tuple(size)) - 1 - margin_px), axis=-1)


def with_z(points: Points, z_mm: float = 0.0) -> Array:
    """Append a height: (..., 2) to (..., 3)."""
    return np.concatenate([points, np.full((*points.shape[:-1], 1), z_mm)], axis=-1)


def homogeneous(points: Points) -> Array:
    """Append a 1: (..., 2) to (..., 3)."""
    return with_z(points, 1.0)


def root_mean_square(values: Array) -> float:
    """Return the root of the mean square; NaN of none."""
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else float("nan")


def normal_cdf(z: Array) -> Array:
    """Return Φ, to 1e-7 (Abramowitz and Stegun 7.1.26; numpy has no erf)."""
    a = np.abs(z) * sqrt(0.5)  # a plain float: 32 bits stay 32 bits
    t = 1 / (1 + 0.3275911 * a)
    tail = t * (
        0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))
    )
    half = 0.5 * tail * np.exp(-a * a)
    return np.where(z < 0, half, 1 - half)


def unreachable_where(bad: Mask, points: Points) -> Points:
    """The points, with NaN in both coordinates where bad (...) is true or either coordinate is not finite."""
    bad = bad | ~np.isfinite(points).all(axis=-1)
    return np.where(bad[..., None], np.nan, points)
