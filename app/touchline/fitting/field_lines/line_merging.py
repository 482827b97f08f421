"""Merging edge chains that are straight once undistorted into long lines."""

from collections.abc import Sequence

import numpy as np

from touchline.core.geometry import Array, Points
from touchline.fitting.field_lines.blind_distortion import UndistortedPlane

STRAIGHT_PX = 1.6  # rms of a chain that may be part of a line
MIN_COSINE = np.cos(np.radians(2.0))
MAX_OFFSET_PX = 5.0
MIN_LENGTH = 0.03  # of the half diagonal


def merge_chains(chains: Sequence[Points], plane: UndistortedPlane, most: int) -> list[Array]:
    """Merge chains of raw px to lines in the undistorted plane, homogeneous (3,) of unit normal, longest first."""
    groups: list[list[Points]] = []
    fitted: list[tuple[Array, Array, float]] = []
    lengths: list[float] = []
    for chain in chains:
        points = plane.undistorted_from_raw(chain[:: max(1, len(chain) // 60)])
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) < 3:
            continue
        middle, along, rms = _fit(points)
        length = float(np.ptp(points @ along))
        if rms * plane.unit_px > STRAIGHT_PX or length < MIN_LENGTH:
            continue
        for i, (m, d, _) in enumerate(fitted):
            aside = np.abs((points - m) @ np.array([-d[1], d[0]])).max() * plane.unit_px
            if abs(along @ d) > MIN_COSINE and aside < MAX_OFFSET_PX:
                groups[i].append(points)
                fitted[i] = _fit(np.concatenate(groups[i]))
                lengths[i] += length
                break
        else:
            groups.append([points])
            fitted.append((middle, along, rms))
            lengths.append(length)
    order = np.argsort(-np.array(lengths), kind="stable")[:most]
    return [_line(*fitted[i][:2]) for i in order]


def _fit(points: Points) -> tuple[Array, Array, float]:
    middle = points.mean(axis=0)
    values, vectors = np.linalg.eigh((points - middle).T @ (points - middle))
    return middle, vectors[:, 1], float(np.sqrt(max(values[0], 0) / len(points)))


def _line(middle: Array, along: Array) -> Array:
    normal = np.array([-along[1], along[0]])
    return np.array([*normal, -normal @ middle])
