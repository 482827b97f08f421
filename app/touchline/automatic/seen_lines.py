"""What a picture shows of lines, made once for every field and area that is looked for in it.

The lens comes first, from lines that are not identified: the division term under which most of them are straight. Then
chains that are straight under it are merged to long lines, and each two lines across two others form a quadrilateral.

Points of the undistorted plane are in half diagonals about the picture's centre, so that r_u = r_d / (1 + bend r_d²)
has a bend of about -1 to 1 for every camera. Arcs do not disturb the estimate: no lens makes them straight.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Array, ImageSize, Points, inside_picture

BENDS = np.linspace(-1.1, 0.5, 65)  # from a fisheye's to a pincushion's
FINER_STEPS = np.linspace(-0.025, 0.025, 21)  # about the best of them
CHAIN_SAMPLES = 25  # of each chain
MAX_BEND_CHAINS = 60  # the longest, of which the bend is estimated
MIN_BEND_CHAIN_LENGTH = 0.08  # of the diagonal: shorter chains bow too little to measure
STRAIGHT_RMS_PX = 0.7  # of a chain that a bend makes straight
NO_BEND_WEIGHT = 0.02  # of the score, for each unit of bend: a prior for none
MIN_DENOMINATOR = 0.05  # 1 + bend r²: at zero lies the bend's horizon

MAX_LINES = 16
MAX_LINE_RMS_PX = 1.6  # of a chain that may be part of a line
MIN_LINE_COSINE = np.cos(np.radians(2.0))  # between a chain and the line that it is part of
MAX_LINE_OFFSET_PX = 5.0  # likewise
MIN_LINE_CHAIN_LENGTH = 0.03  # of the half diagonal
MAX_FITTED_POINTS = 60  # of each chain, about

# half diagonals: lines that are parallel on the carpet never meet in the picture
MIN_VANISHING_DISTANCE = 0.7
MIN_QUADRILATERAL_AREA = 0.02  # square half diagonals
# of the first corner's: a quadrilateral with a corner behind the camera is none
MIN_CORNER_DEPTH = 0.05

MAP_LONG_SIDE = 420  # of the map of distances, px: finer than the bend is known
DIRECTIONS = 4  # directions of ridges that are mapped apart
# steps from a map's direction: a ridge between two directions counts for both
MAX_DIRECTIONS_OFF = 0.8
MAX_RIDGE_DISTANCE_PX = 5.0  # of the map: further off, nothing is found
NO_RIDGE_PX = 1e3  # the distance in a map without ridges


@dataclass(frozen=True)
class UndistortedPlane:
    """The undistorted picture: from raw px to half diagonals about the centre, and back."""

    bend: float
    centre: tuple[float, float]
    unit_px: float

    @classmethod
    def of(cls, size: ImageSize, bend: float = 0.0) -> Self:
        return cls(bend, size.centre, float(np.hypot(size.width, size.height)) / 2)

    def undistorted_from_raw(self, points: Points) -> Points:
        """Map raw pixels (..., 2) to the plane; NaN beyond the bend's horizon."""
        distorted = (points - np.array(self.centre)) / self.unit_px
        denominator = 1 + self.bend * np.sum(distorted * distorted, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            return distorted / np.where(denominator > MIN_DENOMINATOR, denominator, np.nan)

    def raw_from_undistorted(self, points: Points) -> Points:
        """Map the plane (..., 2) to raw pixels; NaN where the picture would fold."""
        radius_squared = np.sum(points * points, axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            # r_d solves bend r_u r_d² - r_d + r_u = 0; this form of the root holds for a bend of zero too.
            scale = 2 * self.unit_px / (1 + np.sqrt(1 - 4 * self.bend * radius_squared))
        return points * scale + np.array(self.centre, points.dtype)


def estimate_bend(chains: Sequence[Points], size: ImageSize) -> float:
    """Estimate the bend under which most of the chains' length is straight; 0 where none is long enough."""
    plane = UndistortedPlane.of(size)
    min_length_px = 2 * MIN_BEND_CHAIN_LENGTH * plane.unit_px
    long = [chain for chain in chains if np.linalg.norm(chain[-1] - chain[0]) > min_length_px][
        :MAX_BEND_CHAINS
    ]
    if not long:
        return 0.0
    sampled = np.stack(
        [chain[np.linspace(0, len(chain) - 1, CHAIN_SAMPLES).round().astype(int)] for chain in long]
    )
    distorted = plane.undistorted_from_raw(sampled)
    length = np.linalg.norm(distorted[:, -1] - distorted[:, 0], axis=1)
    coarse = BENDS[np.argmax(_straightness(distorted, length, BENDS, plane.unit_px, 2.0))]
    finer = coarse + FINER_STEPS
    return float(finer[np.argmax(_straightness(distorted, length, finer, plane.unit_px, 1.0))])


def _straightness(
    distorted: Array, length: Array, bends: Array, unit_px: float, tolerance: float
) -> Array:
    """Return how much length each bend makes straight (m,). distorted (c, n, 2), length (c,).

    tolerance: times STRAIGHT_RMS_PX, at which a chain counts for little more than a third.
    """
    denominator = 1 + bends[:, None, None] * np.sum(distorted * distorted, axis=-1)
    undistorted = distorted / np.maximum(denominator, MIN_DENOMINATOR)[..., None]
    centred = undistorted - undistorted.mean(axis=2, keepdims=True)
    xx, yy, xy = (
        (centred[..., i] * centred[..., j]).mean(axis=2) for i, j in ((0, 0), (1, 1), (0, 1))
    )
    # The eigenvalues of a chain's scatter are its mean squares across (low) and along (high) its straight line.
    root = np.sqrt((xx - yy) ** 2 / 4 + xy**2)
    low, high = np.maximum((xx + yy) / 2 - root, 0), (xx + yy) / 2 + root
    # As a share of the chain's own length, so that a bend gains nothing by shrinking the picture: a straight chain of
    # length l has a mean square of l²/12 along it.
    rms_px = np.sqrt(low / np.maximum(high, 1e-12) / 12) * length * unit_px
    score = (length * np.exp(-((rms_px / (tolerance * STRAIGHT_RMS_PX)) ** 2))).sum(axis=1)
    return score - NO_BEND_WEIGHT * length.sum() * np.abs(bends)


def merge_chains(chains: Sequence[Points], plane: UndistortedPlane, most: int) -> list[Array]:
    """Merge chains of raw px to lines in the undistorted plane, homogeneous (3,) of unit normal, longest first."""
    groups: list[list[Points]] = []
    fitted: list[tuple[Array, Array, float]] = []
    lengths: list[float] = []
    for chain in chains:
        points = plane.undistorted_from_raw(chain[:: max(1, len(chain) // MAX_FITTED_POINTS)])
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) < 3:
            continue
        middle, along, rms = _fitted_line(points)
        length = float(np.ptp(points @ along))
        if rms * plane.unit_px > MAX_LINE_RMS_PX or length < MIN_LINE_CHAIN_LENGTH:
            continue
        for i, (line_middle, line_along, _) in enumerate(fitted):
            normal = np.array([-line_along[1], line_along[0]])
            offset_px = np.abs((points - line_middle) @ normal).max() * plane.unit_px
            if abs(along @ line_along) > MIN_LINE_COSINE and offset_px < MAX_LINE_OFFSET_PX:
                groups[i].append(points)
                fitted[i] = _fitted_line(np.concatenate(groups[i]))
                lengths[i] += length
                break
        else:
            groups.append([points])
            fitted.append((middle, along, rms))
            lengths.append(length)
    order = np.argsort(-np.array(lengths), kind="stable")[:most]
    return [_homogeneous_line(*fitted[i][:2]) for i in order]


def _fitted_line(points: Points) -> tuple[Array, Array, float]:
    """Return the middle, the direction and the rms across it of the line nearest to points (n, 2)."""
    middle = points.mean(axis=0)
    values, vectors = np.linalg.eigh((points - middle).T @ (points - middle))
    return middle, vectors[:, 1], float(np.sqrt(max(values[0], 0) / len(points)))


def _homogeneous_line(middle: Array, along: Array) -> Array:
    normal = np.array([-along[1], along[0]])
    return np.array([*normal, -normal @ middle])


def parallel_pairs(lines: list[Array]) -> list[tuple[int, int]]:
    """Return indices of each two lines that may be parallel on the carpet."""
    meeting = {(a, b): np.cross(lines[a], lines[b]) for a, b in combinations(range(len(lines)), 2)}
    return [
        pair
        for pair, at in meeting.items()
        if np.hypot(at[0], at[1]) > MIN_VANISHING_DISTANCE * abs(at[2])
    ]


def quadrilaterals(lines: list[Array]) -> Array:
    """Return (q, 3, 3) from the unit square to each two lines across two others."""
    pairs = parallel_pairs(lines)
    across = np.array([(*a, *b) for a in pairs for b in pairs if not set(a) & set(b)], int).reshape(
        -1, 4
    )
    if not len(across):
        return np.empty((0, 3, 3))
    line = np.array(lines)
    meeting = [
        np.cross(line[across[:, a]], line[across[:, b]])
        for a, b in ((0, 2), (1, 2), (1, 3), (0, 3))
    ]
    with np.errstate(all="ignore"):
        corners = np.stack([at[:, :2] / at[:, 2:] for at in meeting], axis=1)
        maps = square_maps(corners)
        (x0, x1, x2, x3), (y0, y1, y2, y3) = corners[..., 0].T, corners[..., 1].T
        # half the cross product of its diagonals
        area = np.abs((x0 - x2) * (y1 - y3) - (x1 - x3) * (y0 - y2)) / 2
        g, h = maps[:, 2, 0], maps[:, 2, 1]
        # of the other corners; the first one's is 1
        least_depth = np.minimum(np.minimum(1 + g, 1 + h), 1 + g + h)
    is_sound = (least_depth > MIN_CORNER_DEPTH) & (area > MIN_QUADRILATERAL_AREA)
    return maps[is_sound & np.isfinite(maps).all(axis=(1, 2))]


def square_maps(corners: Array) -> Array:
    """Return (q, 3, 3) from the unit square's corners (0, 0), (1, 0), (1, 1), (0, 1) to (q, 4, 2); NaN for none.

    The closed form of Heckbert, Fundamentals of Texture Mapping and Image Warping, 1989, section 2.2.3.
    """
    (x0, x1, x2, x3), (y0, y1, y2, y3) = corners[..., 0].T, corners[..., 1].T
    with np.errstate(all="ignore"):
        dx1, dx2, sum_x = x1 - x2, x3 - x2, x0 - x1 + x2 - x3
        dy1, dy2, sum_y = y1 - y2, y3 - y2, y0 - y1 + y2 - y3
        determinant = dx1 * dy2 - dx2 * dy1
        g, h = (sum_x * dy2 - dx2 * sum_y) / determinant, (dx1 * sum_y - sum_x * dy1) / determinant
        return np.stack(
            [
                np.stack([x1 - x0 + g * x1, x3 - x0 + h * x3, x0], -1),
                np.stack([y1 - y0 + g * y1, y3 - y0 + h * y3, y0], -1),
                np.stack([g, h, np.ones_like(g)], -1),
            ],
            axis=1,
        )


@dataclass(frozen=True, eq=False)
class RidgeMaps:
    """distances (DIRECTIONS, h, w): px to the nearest ridge of about that direction; scale from raw px to the map's.

    length_px: of all ridges, raw px.
    """

    distances: NDArray[np.float32]
    scale: float
    size: ImageSize
    length_px: float

    @classmethod
    def of(cls, points: Points, along: Array, size: ImageSize) -> Self:
        """Make maps of ridges: points (n, 2) raw px, along (n, 2) unit vectors."""
        scale = MAP_LONG_SIDE / max(size.width, size.height)
        shape = (int(np.ceil(size.height * scale)) + 1, int(np.ceil(size.width * scale)) + 1)
        column, row = np.rint(points * scale).astype(int).T
        direction = np.arctan2(along[:, 1], along[:, 0]) % np.pi * (DIRECTIONS / np.pi)
        maps = []
        for of_map in range(DIRECTIONS):
            # Directions are modulo a half turn, which is DIRECTIONS steps.
            off = np.abs((direction - of_map + DIRECTIONS / 2) % DIRECTIONS - DIRECTIONS / 2)
            near = off < MAX_DIRECTIONS_OFF
            is_empty = np.full(shape, 255, np.uint8)
            is_empty[row[near], column[near]] = 0
            maps.append(
                cv2.distanceTransform(is_empty, cv2.DIST_L2, 3)
                if near.any()
                else np.full(shape, NO_RIDGE_PX, np.float32)
            )
        return cls(np.stack(maps), scale, size, float(len(points)))

    def found(self, raw: Points, along: Array) -> Array:
        """Return (...,) 0 to 1: how near a ridge of that direction is; 0 outside the picture."""
        inside = inside_picture(raw, self.size, 2)
        at = np.rint(np.where(inside[..., None], raw, 0) * self.scale).astype(np.int32)
        angle = np.arctan2(along[..., 1], along[..., 0]) % np.pi
        direction = np.rint(angle * (DIRECTIONS / np.pi)).astype(np.int32) % DIRECTIONS
        distance = self.distances[direction, at[..., 1], at[..., 0]]
        return np.where(inside, np.maximum(1 - (distance / MAX_RIDGE_DISTANCE_PX) ** 2, 0), 0.0)


@dataclass(frozen=True, eq=False)
class SeenLines:
    """points (n, 2) raw px on ridges, along (n, 2) unit vectors; lines: the longest, homogeneous, in the plane."""

    size: ImageSize
    plane: UndistortedPlane
    points: Points
    along: Array
    lines: list[Array]
    ridges: RidgeMaps

    @classmethod
    def of(cls, chains: Sequence[Points], along: Sequence[Array], size: ImageSize) -> Self:
        """chains: points (n, 2) raw px along each ridge, longest first; along: unit vectors at them."""
        plane = UndistortedPlane.of(size, estimate_bend(chains, size))
        points, directions = (
            np.concatenate([np.empty((0, 2)), *parts]) for parts in (chains, along)
        )
        return cls(
            size,
            plane,
            points,
            directions,
            merge_chains(chains, plane, MAX_LINES),
            RidgeMaps.of(points, directions, size),
        )

    @cached_property
    def quadrilaterals(self) -> Array:
        """Of each two lines across two others, (q, 3, 3) from the unit square."""
        return quadrilaterals(self.lines)

    def within(self, outline: Points) -> Self:
        """Return the same of which only the points within an outline (k, 2) px count; the lines stay."""
        mask = np.zeros((self.size.height, self.size.width), np.uint8)
        cv2.fillPoly(mask, [np.round(outline).astype(np.int32)], 1)
        column, row = np.round(self.points).astype(int).T
        inside = (
            mask[np.clip(row, 0, self.size.height - 1), np.clip(column, 0, self.size.width - 1)] > 0
        )
        return replace(self, points=self.points[inside], along=self.along[inside])

    def sampled(self, most: int) -> tuple[Points, Array]:
        """Return so many of the points, and the directions there; the same each time."""
        picked = np.random.default_rng(0).permutation(len(self.points))[:most]
        return self.points[picked], self.along[picked]
