"""The odd series nearest to a division lens: where fits of other lenses start."""

import numpy as np

from touchline.core.geometry import Array

MIN_DENOMINATOR = 0.2  # of the division lens, beyond which it says nothing of others


def division_radii(k: float, corner: float) -> tuple[Array, Array]:
    """Return undistorted and distorted radii (n,) of a division lens, out to a distorted radius."""
    distorted = np.linspace(corner / 40, corner, 40)
    below = 1 + k * distorted**2
    distorted, below = distorted[below > MIN_DENOMINATOR], below[below > MIN_DENOMINATOR]
    return distorted / below, distorted


def odd_series(radius: Array, distorted: Array, count: int) -> Array:
    """Return c of distorted = r + c₁ r³ + c₂ r⁵ … by least squares, relative to the reach."""
    reach = radius[-1]
    share = radius / reach  # powers of a small r would vanish
    powers = np.stack([share ** (2 * k + 3) for k in range(count)], axis=1)
    found, *_ = np.linalg.lstsq(powers, (distorted - radius) / reach, rcond=None)
    return found / reach ** (2 * np.arange(count) + 2)
