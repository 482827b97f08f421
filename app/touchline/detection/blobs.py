"""Patches of one colour in a picture of colour numbers: by runs along rows, with area, middle, box and form.

Only pixels that have a colour are touched, which is fast where most of the picture is nothing: they become runs, runs
that touch in neighbouring rows (corners too) become patches, and a patch's area and moments are sums over its runs.
"""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Array, Points

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


def _touching(
    y: Numbers, x0: Numbers, x1: Numbers, colour: Numbers, width: int
) -> tuple[Numbers, Numbers]:
    """Pairs of runs of one colour, the second in the row below the first."""
    stride = width + 4
    begins, ends = y * stride + x0, y * stride + x1  # both ascend
    low = np.searchsorted(ends, (y + 1) * stride + x0 - 1)
    high = np.searchsorted(begins, (y + 1) * stride + x1 + 1, side="right")
    count = np.maximum(high - low, 0)
    above = np.repeat(np.arange(len(y)), count)
    below = (
        np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(low, count)
    )
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


# around a blob's box: the pixels that it covers in part, and some of what lies beside it
_BESIDE_PX = 2
_MAX_HALF = 20  # px; a larger blob's middle is known well enough from its pixels


@dataclass(frozen=True, eq=False)
class Blobs:
    """n patches. colour: its number. area (n,) px. middle (n, 2) px. box (n, 4): x0, y0, x1, y1, all within.

    roundness (n,): 1 for a disc, towards 0 for a line. sharpness (n,): grey levels a pixel at its rim; NaN unmeasured.
    """

    colour: NDArray[np.int64]
    area: Array
    middle: Points
    box: NDArray[np.int64]
    roundness: Array
    sharpness: Array

    def __len__(self) -> int:
        return len(self.area)

    def only(self, mask: NDArray[np.bool_]) -> Self:
        return type(self)(
            self.colour[mask],
            self.area[mask],
            self.middle[mask],
            self.box[mask],
            self.roundness[mask],
            self.sharpness[mask],
        )

    @classmethod
    def of(cls, runs: Runs) -> Self:
        n = int(runs.patch.max(initial=-1)) + 1
        length = (runs.x1 - runs.x0 + 1).astype(float)
        mean_x, y = (runs.x0 + runs.x1) / 2, runs.y.astype(float)

        def total(values: Array) -> Array:
            return np.asarray(np.bincount(runs.patch, values, n), np.float64)

        area = total(length)
        middle = (
            np.stack([total(length * mean_x), total(length * y)], axis=-1)
            / np.maximum(area, 1)[:, None]
        )
        dx, dy = mean_x - middle[runs.patch, 0], y - middle[runs.patch, 1]
        # A run of k pixels has (k² - 1) / 12 of its own, and each pixel 1 / 12.
        xx = total(length * (dx * dx + length * length / 12)) / np.maximum(area, 1)
        yy = total(length * (dy * dy + 1 / 12)) / np.maximum(area, 1)
        xy = total(length * dx * dy) / np.maximum(area, 1)
        half, split = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
        # A disc's area is 4 π √(λ1 λ2), and its two λ are equal.
        roundness = np.sqrt(np.maximum(half - split, 0) / np.maximum(half + split, 1e-9))
        box = np.stack(
            [
                _extreme(np.minimum, runs.x0, runs.patch, n, 1 << 30),
                _extreme(np.minimum, runs.y, runs.patch, n, 1 << 30),
                _extreme(np.maximum, runs.x1, runs.patch, n, -1),
                _extreme(np.maximum, runs.y, runs.patch, n, -1),
            ],
            axis=-1,
        )
        colour = np.zeros(n, np.int64)
        colour[runs.patch] = runs.colour
        return cls(colour, area, middle, box, roundness, np.full(n, np.nan))


def _extreme(
    keep: np.ufunc, values: NDArray[np.int64], patch: NDArray[np.int64], n: int, start: int
) -> NDArray[np.int64]:
    found = np.full(n, start, np.int64)
    keep.at(found, patch, values)
    return found


NO_BLOBS = Blobs.of(NO_RUNS)


def fine_middles(
    pixels: NDArray[np.uint8], blobs: Blobs, labels: NDArray[np.uint8] | None = None
) -> Points:
    """Return middles (n, 2) px weighted by how much of each pixel the blob covers.

    labels: what belongs to another colour. A pixel at the rim is a mixture p = α blob + (1 - α) beside; α is found
    along the way from one colour to the other.
    """
    middles = blobs.middle.copy()
    half_size = (blobs.box[:, 2:] - blobs.box[:, :2] + 1) / 2
    small = np.flatnonzero((half_size.max(axis=1, initial=0) <= _MAX_HALF) & (blobs.area >= 4))
    if not small.size:
        return middles
    half, box, coarse = half_size[small], blobs.box[small], middles[small]
    x, y, inside = _windows(half, box, pixels)
    y_in, x_in = np.clip(y, 0, pixels.shape[0] - 1), np.clip(x, 0, pixels.shape[1] - 1)
    window = pixels[y_in, x_in].astype(np.float32)  # (n, k, k, 3)
    if labels is not None:  # a patch that touches is neither of this one nor what lies beside it
        owner = labels[y_in, x_in]
        inside &= (owner == 0) | (owner == blobs.colour[small, None, None])
    # px outside the box, and the distance from the middle in half-sizes of the blob's own ellipse: 1 is its rim.
    about = (box[:, :2] + box[:, 2:]) / 2
    out_x = np.abs(x - about[:, 0, None, None]) - half[:, 0, None, None]
    out_y = np.abs(y - about[:, 1, None, None]) - half[:, 1, None, None]
    from_middle = np.hypot(
        (x - coarse[:, 0, None, None]) / half[:, 0, None, None],
        (y - coarse[:, 1, None, None]) / half[:, 1, None, None],
    )
    core = inside & (from_middle < 0.6)
    beside = inside & (np.maximum(out_x, out_y) > 0.5) & (np.maximum(out_x, out_y) <= _BESIDE_PX)
    share = _share_of_blob(window, _mean(window, core), _mean(window, beside))
    near = (
        inside
        & (out_x <= 1.5)
        & (out_y <= 1.5)
        & (from_middle < 1 + 1.5 / half.min(axis=1)[:, None, None])
    )
    weight = np.where(near, np.clip(share, 0, 1), 0)
    weight[weight < 0.15] = 0  # what lies beside is never quite of one colour
    sums = weight.sum(axis=(1, 2))
    fine = (
        np.stack([(weight * x).sum(axis=(1, 2)), (weight * y).sum(axis=(1, 2))], -1)
        / np.maximum(sums, 1)[:, None]
    )
    # Two pixels from where its pixels say it is, something else was weighed.
    good = (sums > 0.5 * blobs.area[small]) & (np.linalg.norm(fine - coarse, axis=1) < 2)
    middles[small[good]] = fine[good]
    return middles


def _windows(
    half: Array, box: NDArray[np.int64], pixels: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return columns (n, 1, k) and rows (n, k, 1) around each box, as many for all, and which are in the picture."""
    reach = int(np.ceil(half.max())) + _BESIDE_PX
    steps = np.arange(-reach, reach + 1)
    centre = np.rint((box[:, :2] + box[:, 2:]) / 2).astype(int)
    x, y = (
        centre[:, 0, None, None] + steps[None, None, :],
        centre[:, 1, None, None] + steps[None, :, None],
    )
    return x, y, (x >= 0) & (x < pixels.shape[1]) & (y >= 0) & (y < pixels.shape[0])


def _share_of_blob(
    window: NDArray[np.float32], own: NDArray[np.float32], other: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return α (n, k, k) of each pixel: how far it is along the way from the colour beside to the blob's own."""
    way = own - other
    along = ((window - other[:, None, None]) * way[:, None, None]).sum(-1)
    return along / np.maximum((way * way).sum(-1), 1)[:, None, None]


def _mean(values: NDArray[np.float32], mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    weight = mask[..., None].astype(np.float32)
    return (values * weight).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)), 1)
