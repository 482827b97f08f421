"""Patches of one colour in a picture of colour numbers, by runs along rows: fast where most of the picture is nothing.

Only pixels that have a colour are touched: they become runs, runs that touch in neighbouring rows (corners too) become
patches, and a patch's area and moments are sums over its runs.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Runs:
    """(n,) each: row, first and last column, colour number, and the patch it belongs to."""

    y: Numbers
    x0: Numbers
    x1: Numbers
    colour: Numbers
    patch: Numbers


NO_RUNS = Runs(*[np.zeros(0, np.int64)] * 5)


def runs_of(labels: NDArray[np.uint8]) -> Runs:
    """Of a picture (height, width); in the order of reading."""
    spots = cv2.findNonZero(labels)
    if spots is None:
        return NO_RUNS
    x, y = spots.reshape(-1, 2).T.astype(np.int64)
    colour = labels[y, x].astype(np.int64)
    first = np.ones(len(x), bool)
    first[1:] = (np.diff(x) != 1) | (np.diff(y) != 0) | (np.diff(colour) != 0)
    last = np.append(first[1:], True)
    y, x0, x1, colour = y[first], x[first], x[last], colour[first]
    return Runs(y, x0, x1, colour, _patches(*_touching(y, x0, x1, colour, labels.shape[1]), len(y)))


def _touching(y: Numbers, x0: Numbers, x1: Numbers, colour: Numbers, width: int) -> tuple[Numbers, Numbers]:
    """Pairs of runs of one colour, the second in the row below the first."""
    stride = width + 4
    begins, ends = y * stride + x0, y * stride + x1  # both ascend
    low = np.searchsorted(ends, (y + 1) * stride + x0 - 1)
    high = np.searchsorted(begins, (y + 1) * stride + x1 + 1, side="right")
    count = np.maximum(high - low, 0)
    above = np.repeat(np.arange(len(y)), count)
    below = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(low, count)
    same = colour[above] == colour[below]
    return above[same], below[same]


def _patches(a: Numbers, b: Numbers, count: int) -> Numbers:
    """(count,) the patch of each run, from 0: what is joined by pairs, directly or by way of others."""
    parent = np.arange(count)
    while a.size:
        low = np.minimum(parent[a], parent[b])
        np.minimum.at(parent, parent[a], low)
        np.minimum.at(parent, parent[b], low)
        while not np.array_equal(parent, shorter := parent[parent]):
            parent = shorter
        apart = parent[a] != parent[b]
        a, b = a[apart], b[apart]
    return np.unique(parent, return_inverse=True)[1]
