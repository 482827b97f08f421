"""Thin-plate spline: the displacement of a plane that bends least for what it passes through.

    s(q) = a0 + a1 X + a2 Y + Σ w_i U(|Q - K_i|),   U(r) = r² log r,   Q = (X, Y) = (q - middle) / unit

F. Bookstein, "Principal Warps", PAMI 11 (1989). It is read, and no longer fitted.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array

BLOCK = 1 << 19  # so many kernel values at a time stay in the cache


@dataclass(frozen=True, eq=False)
class Spline:
    """A displacement of the plane: knots (n, 2) normalised, weights (n, 2) and plane (3, 2) px."""

    knots: Array
    weights: Array
    plane: Array

    def __call__(self, places: Array) -> Array:
        """Return the displacement (m, 2) px at normalised places (m, 2)."""
        return self._sum(places, gradient=False)[0]

    def with_gradient(self, places: Array) -> tuple[Array, Array]:
        """Return the displacement and its derivative (m, 2, 2) by the normalised place."""
        return self._sum(places, gradient=True)

    def _sum(self, places: Array, gradient: bool) -> tuple[Array, Array]:
        value = places @ self.plane[1:] + self.plane[0]
        slope = np.broadcast_to(self.plane[1:].T, (len(places), 2, 2)).copy()
        step = max(1, BLOCK // max(1, len(self.knots)))
        for begin in range(0, len(places) if len(self.knots) else 0, step):
            some = places[begin:begin + step]
            square = _squares(some, self.knots)
            log = np.log(square)
            value[begin:begin + step] += (0.5 * square * log) @ self.weights
            if gradient:  # dU/dQ = (log r² + 1) (Q - K)
                log += 1
                for c in range(2):
                    by = log * self.weights[:, c]
                    slope[begin:begin + step, c] += some * by.sum(axis=1, keepdims=True) - by @ self.knots
        return value, slope


def _squares(places: Array, knots: Array) -> Array:
    """Return r² (m, n), at least 1e-300, so that r² log r² is 0 at 0."""
    square = np.subtract.outer(places[:, 0], knots[:, 0]) ** 2
    square += np.subtract.outer(places[:, 1], knots[:, 1]) ** 2
    return np.maximum(square, 1e-300)
