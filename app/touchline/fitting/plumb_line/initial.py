"""A first bend from straight lines: the one of many that straightens most chains.

Chains that are no straight lines in the world would bend the answer; each counts by s / (s + τ²) of its mean square s,
so that beyond a few px it no longer matters how wrong it is (S. Geman and D. McClure 1987).
"""

import numpy as np

from touchline.core.geometry import Array
from touchline.fitting.linear import BENDS
from touchline.fitting.plumb_line.problem import Chains, lines_through

TAU_PX = 1.0  # beyond, a chain's cost hardly grows
MIN_SCALE = 0.05  # of the scale at the centre: beyond, the picture would be torn apart
REFINED_STEPS = 9  # bends between the best and its neighbours, twice


def initial_bend(chains: Chains, centre: Array) -> float:
    """Return k of the division model per unit²."""
    plane = (chains.pixels - centre) / chains.unit_px
    reach2 = float(np.max(np.sum(plane**2, axis=1)))
    tried = np.sort(BENDS[1 + BENDS * 1.0 > MIN_SCALE]) / reach2
    for _ in range(3):
        squares = [np.square(chain_rms(plane, chains, k)) for k in tried]
        best = int(np.argmin([np.sum(chains.counts * s / (s + max(TAU_PX, chains.noise_px) ** 2)) for s in squares]))
        answer = tried[best]
        tried = np.linspace(tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)], REFINED_STEPS)
    return float(answer)


def chain_rms(plane: Array, chains: Chains, k: float) -> Array:
    """Return the rms of each chain (c,), raw px, to first order: its distance from a line in the undistorted plane."""
    gain = 1 / (1 + k * np.sum(plane**2, axis=1))
    straight = plane * gain[:, None]
    angle, offset, _ = lines_through(straight, chains)
    n = np.stack([np.cos(angle), np.sin(angle)], axis=1)[chains.owner]
    off = np.sum(n * straight, axis=1) - offset[chains.owner]
    moves = gain[:, None] * n - 2 * k * (gain**2 * np.sum(plane * n, axis=1))[:, None] * plane
    return np.sqrt(chains.sums((off / np.linalg.norm(moves, axis=1)) ** 2) / chains.counts) * chains.unit_px
