"""The curve of one border: a polynomial of a normalised position.

    value = Σ c_k t^k,   t = (position - centre) / scale            # Eq. (1), (2), (5), (6)

The position is y for a border that runs down the picture and x for one that runs across.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from touchline.core.geometry import Array

MAX_DEGREE = 8


@dataclass(frozen=True)
class Curve:
    """A polynomial of a normalised position; its coefficients ascend."""

    coefficients: tuple[float, ...]
    centre: float
    scale: float

    def __call__(self, position: Array | float) -> Array:
        t: Array = (np.asarray(position, np.float64) - self.centre) / self.scale
        value: Array = np.full_like(t, self.coefficients[-1])
        for c in self.coefficients[-2::-1]:  # Horner, in place: a map asks for millions
            value *= t
            value += c
        return value

    @property
    def degree(self) -> int:
        return len(self.coefficients) - 1

    def plain_coefficients(self) -> tuple[float, ...]:
        """Return ascending coefficients in the position itself: Σ a_k position^k."""
        result: NDArray[np.floating] = np.zeros(1)
        for c in reversed(self.coefficients):  # Horner, with polynomials for numbers
            result = polynomial.polyadd(polynomial.polymul(result, (-self.centre / self.scale, 1 / self.scale)), (c,))
        return tuple(float(c) for c in np.pad(result, (0, len(self.coefficients) - len(result)))[: self.degree + 1])
