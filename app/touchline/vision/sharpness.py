"""How sharp a picture is in each of its nine zones, by how wide its edges are.

Width is the way across an edge from a fifth to four fifths of its height, in pixels of the picture as given. A step
blurred by a Gaussian of σ px is 1.68 σ wide; a line thinner than the blur somewhat less. Edges are looked for in a
reduced picture and measured in the full one.

Not everything soft is out of focus. The sharper edges of a zone speak for it, because shadows and moving robots are
soft in any focus. A soft edge counts only if it goes straight on to both sides, which blotches of a carpet do not, and
is not faint: blur spreads an edge but keeps contrast times width, so what is both faint and soft was never sharp, such
as the mirror image of a lamp. A zone without edges says nothing.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.geometry import Points
from touchline.core.opencv import to_grey
from touchline.core.statements import say
from touchline.vision.zones import (
    Advice,
    field_mask,
    first_capital,
    message,
    zone_names,
    zone_slices,
)

SEARCH_WIDTH_PX = 640  # px: edges are looked for in a picture this wide
BLOCK = 16  # px of it: no two edge points are nearer than a block or so
MAX_EDGES = 20  # edge points of a zone
MIN_EDGES = 5
# grey levels, from the edge's one side to its other; the carpet's own marks have less
CONTRAST = 16.0
SOFT_CONTRAST = 22.0  # where the edge is soft
NOISES = 7.0  # and as many times the noise
SLOPE = 40.0  # of a 3 × 3 Sobel in the reduced picture: a step of 10 levels
REACH_PX = 12.0  # to either side; an edge wider than this is as soft as words can say
STEP_PX = 0.5
ALONG_PX = 10.0  # to either side, the edge must go on
ALIKE = 0.8  # least correlation with the edge there
# where it may be, as its direction is not known well
SHIFTS_PX = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
FAINT = 0.6  # of the usual contrast times width
SOFT_PX, VERY_SOFT_PX = 2.5, 5.0
WORSE = 1.6  # times as wide as the picture's best zones


class SharpnessJson(TypedDict):
    best_px: float | None
    width_px: list[float | None]
    edges: list[int]


@dataclass(frozen=True)
class Sharpness:
    """width_px: of the edges, for each of the nine ZONES; None where there are none. edges: how many were measured.

    best_px: what the sharper zones have; None without any.
    """

    best_px: float | None
    width_px: tuple[float | None, ...]
    edges: tuple[int, ...]

    def to_json(self) -> SharpnessJson:
        return {"best_px": self.best_px, "width_px": list(self.width_px), "edges": list(self.edges)}


def measure_sharpness(picture: NDArray[np.uint8], field: NDArray | None = None) -> Sharpness:
    """Measure a picture, (height, width, 3) BGR or (height, width) grey.

    field: its mask, also of the picture reduced, or its polygon in pixels, where it is known; nothing outside counts.
    """
    height, width = picture.shape[:2]
    shape = (
        field.shape
        if field is not None and field.dtype == np.bool_ and field.ndim == 2
        else (height, width)
    )
    mask = field_mask(field, *shape)
    if min(height, width) < 3 * BLOCK:
        return Sharpness(None, (None,) * 9, (0,) * 9)
    grey = to_grey(picture)
    places, normals, zone = _edge_points(grey, mask)
    wide = _edge_widths(grey, places, normals) if len(places) else np.empty(0)
    widths, counts = [], []
    for i in range(9):
        here = wide[(zone == i) & np.isfinite(wide)]
        counts.append(len(here))
        widths.append(round(float(np.quantile(here, 0.3)), 2) if len(here) >= MIN_EDGES else None)
    known = [w for w in widths if w is not None]
    return Sharpness(
        round(float(np.quantile(known, 0.25)), 2) if known else None, tuple(widths), tuple(counts)
    )


def _edge_points(
    grey: NDArray[np.uint8], mask: NDArray[np.bool_] | None
) -> tuple[Points, Points, NDArray]:
    """Places (n, 2) px of strong edges, their unit normals towards the bright side, and their zones (n,)."""
    height, width = grey.shape
    scale = max(1.0, width / SEARCH_WIDTH_PX)
    size = (round(width / scale), round(height / scale))
    small = grey if scale == 1 else cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    across, down = (cv2.Sobel(small, cv2.CV_32F, *order, ksize=3) for order in ((1, 0), (0, 1)))
    steep = np.asarray(cv2.magnitude(across, down), np.float32)
    margin = 2 + int(np.ceil(3 / scale))
    steep[:margin] = steep[-margin:] = steep[:, :margin] = steep[:, -margin:] = 0
    if mask is not None:
        steep[cv2.resize(mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) == 0] = 0
    rows, columns = _steepest_in_blocks(steep)
    strength = steep[rows, columns]
    zones = np.empty(small.shape, np.int8)
    for i, part in enumerate(zone_slices(*small.shape)):
        zones[part] = i
    zone = zones[rows, columns]
    keep = np.concatenate(
        [
            np.flatnonzero((zone == i) & (strength > SLOPE))[
                np.argsort(-strength[(zone == i) & (strength > SLOPE)], kind="stable")[:MAX_EDGES]
            ]
            for i in range(9)
        ]
    )
    rows, columns = rows[keep], columns[keep]
    normals = np.stack([across[rows, columns], down[rows, columns]], axis=-1) / strength[keep, None]
    # A reduced pixel's centre, in the full picture.
    places = (np.stack([columns, rows], axis=-1) + 0.5) * (width / size[0], height / size[1]) - 0.5
    return places, normals.astype(np.float64), zone[keep]


def _steepest_in_blocks(steep: NDArray[np.float32]) -> tuple[NDArray, NDArray]:
    """Rows and columns of the steepest pixel in each whole block."""
    h, w = (n // BLOCK for n in steep.shape)
    blocks = (
        steep[: h * BLOCK, : w * BLOCK]
        .reshape(h, BLOCK, w, BLOCK)
        .swapaxes(1, 2)
        .reshape(h * w, -1)
    )
    best = blocks.argmax(axis=1)
    at = np.arange(h * w)
    return at // w * BLOCK + best // BLOCK, at % w * BLOCK + best % BLOCK


def _edge_widths(grey: NDArray[np.uint8], places: Points, normals: Points) -> NDArray[np.float64]:
    """(n,) px from a fifth to four fifths of the way up each edge; NaN where that cannot be told."""
    # the reduced picture knows the place no better
    search = 1.5 * max(1.0, grey.shape[1] / SEARCH_WIDTH_PX) + 1
    t = np.arange(-REACH_PX - search, REACH_PX + search + STEP_PX, STEP_PX)
    # Three ways side by side have less noise than one.
    profile = np.mean(
        [_profiles(grey, places, normals, t, beside) for beside in (-1.5, 0.0, 1.5)], axis=0
    )
    middle = np.flatnonzero(np.abs(t) <= search)
    rise = profile[:, middle[1:] + 1] - profile[:, middle[1:] - 1]
    steepest = middle[1:][rise.argmax(axis=1)]
    away = round(REACH_PX / STEP_PX)
    window = np.clip(steepest[:, None] + np.arange(-away, away + 1), 0, len(t) - 1)
    flank = np.take_along_axis(profile, window, axis=1)
    low, high = flank[:, : away + 1].min(axis=1), flank[:, away:].max(axis=1)
    contrast = high - low
    with np.errstate(divide="ignore", invalid="ignore"):
        shape = (flank - low[:, None]) / contrast[:, None]
        wide = (_until_high(shape[:, away:]) + _until_high(1 - shape[:, away::-1])) * STEP_PX
    wide[contrast < max(CONTRAST, NOISES * _noise(grey))] = np.nan
    strength = contrast * wide
    usual = np.nanmedian(strength) if np.isfinite(strength).any() else 0.0
    soft = np.flatnonzero(wide > SOFT_PX)
    doubtful = (strength[soft] < FAINT * usual) | (contrast[soft] < SOFT_CONTRAST)
    for beside in (-ALONG_PX, ALONG_PX) if soft.size else ():
        doubtful |= ~_goes_on(
            profile[soft], _profiles(grey, places[soft], normals[soft], t, beside)
        )
    wide[soft[doubtful]] = np.nan
    return wide


def _profiles(
    grey: NDArray[np.uint8], places: Points, normals: Points, t: NDArray, beside_px: float
) -> NDArray[np.float32]:
    """(n, len(t)) grey levels on the way across each edge, beside_px along it."""
    along = np.stack([-normals[:, 1], normals[:, 0]], axis=-1)
    at = ((places + beside_px * along)[:, None] + t[:, None] * normals[:, None]).astype(np.float32)
    return cv2.remap(
        grey, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(np.float32)


def _goes_on(here: NDArray[np.float32], there: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether two profiles (n, m) are alike, somewhat shifted perhaps."""
    most = round(SHIFTS_PX[-1] / STEP_PX)
    best = np.full(len(here), -1.0)
    for shift in SHIFTS_PX:
        start = most + round(shift / STEP_PX)
        a, b = here[:, most:-most], there[:, start : start + here.shape[1] - 2 * most]
        a, b = a - a.mean(axis=1, keepdims=True), b - b.mean(axis=1, keepdims=True)
        size = np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1))
        best = np.maximum(best, (a * b).sum(axis=1) / np.maximum(size, 1e-6))
    return best > ALIKE


def _noise(grey: NDArray[np.uint8]) -> float:
    """Standard deviation of noise and fine texture, from neighbours in a few rows."""
    rows = grey[:: max(1, grey.shape[0] // 24)].astype(np.int16)
    return float(np.median(np.abs(np.diff(rows, 2, axis=1)))) * 1.4826 / np.sqrt(6)


def _until_high(values: NDArray) -> NDArray[np.float64]:
    """At which sample (n,), between samples, a row of values first reaches 0.8; NaN if it does not."""
    there = values >= 0.8
    i = there.argmax(axis=1)
    n = np.arange(len(values))
    after, before = values[n, i], values[n, np.maximum(i - 1, 0)]
    part = np.where(i > 0, (0.8 - before) / np.where(after > before, after - before, 1), 0.0)
    return np.where(there.any(axis=1), np.maximum(i - 1, 0) + part, np.nan)


def advice(sharpness: Sharpness) -> list[Advice]:
    known = {i: w for i, w in enumerate(sharpness.width_px) if w is not None}
    best = sharpness.best_px
    if best is None:
        return [
            message(
                say("focus.unknown", "Focus unknown: no edges detected."),
                say("focus.point-at-lines", "Point the camera at the field's lines, or light it."),
                False,
            )
        ]
    if best > SOFT_PX:
        return [
            message(
                say(
                    "focus.all-soft",
                    "Whole image soft: the sharpest edges are {px:px} px wide.",
                    px=best,
                ),
                say(
                    "focus.turn-ring",
                    "Turn the focus ring of the lens until this value is smallest, then lock it.",
                ),
                best > VERY_SOFT_PX,
            )
        ]
    soft = [i for i, w in known.items() if w > WORSE * best and w > SOFT_PX]
    if not soft:
        return []
    worst = max(known[i] for i in soft)
    return [
        message(
            say(
                "focus.zones-soft",
                "{zones} soft: edges {px:px} px wide, {best_px:px} px in the sharpest area.",
                zones=first_capital(zone_names(soft, known)),
                px=worst,
                best_px=best,
            ),
            say(
                "focus.halfway",
                "Focus halfway between near and far, close the iris a little, and clean the "
                "lens. Check that the lens is mounted straight.",
            ),
            worst > VERY_SOFT_PX,
        )
    ]
