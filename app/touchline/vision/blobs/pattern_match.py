"""How much of two colours is in a pixel, and where four dots of them stand around a middle.

    p = a · first + b · second + k · grey        three channels, three unknowns: shade and hull go into k

All robots of a frame are measured together: leading axis n.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.core.colour_profile import Bgr
from touchline.core.geometry import Array, Points
from touchline.core.ssl_pattern import DOT_ANGLES, DOT_MM, DOTS_AT_MM, DOTS_MM

_ANGLES = 72  # around the ring
_TURNS = 360  # orientations that are tried
_RINGS_MM = (53.0, 59.0, 65.0, 71.0, 77.0)
_AROUND_MM = 27.0  # a dot and its rim; the next dot's rim begins at 50
_MAX_HALF_PX = 16  # finer pictures are thinned
_DOT_AREA_MM2 = np.pi * (DOT_MM / 2) ** 2
_TEAM_WEIGHT = 1.5  # of the middle dot in the fit: it is larger


@dataclass(frozen=True, eq=False)
class Patterns:
    """n patterns. middle (n, 2) mm beside the place that was given. turn (n,) rad. rest_mm (n,): rms of five dots.

    green (n, 4) which dots are of the second colour. sure (n, 4): 0…1. cover (n, 4): a whole dot is 1.
    """

    middle: Points
    turn: Array
    rest_mm: Array
    green: NDArray[np.bool_]
    sure: Array
    cover: Array


def unmixing(first: Bgr, second: Bgr, light: Bgr = (1.0, 1.0, 1.0)) -> Array:
    """(2, 3): the shares a and b of a pixel's BGR. light: by which the colours, and grey, have changed since."""
    mixed = np.stack([first, second, (128.0,) * 3], axis=-1) * np.array(light)[:, None]
    return np.linalg.inv(mixed)[:2].astype(np.float32)


def patterns_at(pixels: NDArray[np.uint8], middles: Points, mm_per_px: Array, unmix: Array) -> Patterns:
    """Of robots whose team's dots are at middles (n, 2) px; mm_per_px (n, 2, 2) there."""
    px_per_mm = np.asarray(np.linalg.inv(mm_per_px), np.float64)
    shares = _ring(pixels, middles, px_per_mm, unmix)
    turn = _turned(shares.sum(axis=-1))
    dots, totals, scale = _dots(pixels, middles, mm_per_px, px_per_mm, turn, unmix)
    middle, turn, rest = _fitted(dots, totals.sum(axis=-1) > 0)
    whole = totals.sum(axis=-1)
    first, second = totals[..., 0], totals[..., 1]
    present = np.minimum(np.median(whole, axis=1) * scale / (0.35 * _DOT_AREA_MM2), 1)  # of the four dots' area
    return Patterns(middle, turn, rest, second > first, np.abs(second - first) / np.maximum(whole, 1e-9),
                    whole / np.maximum(np.median(whole, axis=1), 1e-9)[:, None] * present[:, None])


def _sample(pixels: NDArray[np.uint8], at: Points, unmix: Array) -> Array:
    """Shares (..., 2), not below 0, of the pixels next to (..., 2) px."""
    h, w = pixels.shape[:2]
    x, y = (np.rint(at[..., i]).astype(np.int32) for i in (0, 1))
    inside = (x >= 0) & (x < w) & (y >= 0) & (y < h)
    sampled = pixels.reshape(-1, 3)[np.where(inside, y * w + x, 0)].astype(np.float32)
    return np.maximum(sampled @ unmix.T, 0) * inside[..., None]


def _ring(pixels: NDArray[np.uint8], middles: Points, px_per_mm: Array, unmix: Array) -> Array:
    """(n, angles, 2) mean shares at each angle."""
    angle = np.arange(_ANGLES) * (2 * np.pi / _ANGLES)
    away = np.stack([np.cos(angle), np.sin(angle)], -1)[:, None] * np.array(_RINGS_MM)[:, None]
    at = middles[:, None] + (away.reshape(-1, 2) @ px_per_mm.transpose(0, 2, 1))
    return _sample(pixels, at, unmix).reshape(len(middles), _ANGLES, len(_RINGS_MM), 2).mean(axis=2)


def _template() -> Array:
    """(angles, turns): where dots are for each turn, without its mean, so that no brightness wins."""
    angle = np.arange(_ANGLES)[:, None] * (2 * np.pi / _ANGLES)
    turn = np.arange(_TURNS) * (2 * np.pi / _TURNS)
    half = np.arcsin(DOT_MM / 2 / DOTS_AT_MM)
    near = np.zeros((_ANGLES, _TURNS))
    for dot in DOT_ANGLES:
        off = np.abs((angle - turn - dot + np.pi) % (2 * np.pi) - np.pi)
        near = np.maximum(near, np.sqrt(np.clip(1 - (off / half) ** 2, 0, None)))
    return near - near.mean(axis=0)


_TEMPLATE = _template()


def _turned(cover: Array) -> Array:
    """(n,) the turn at which four dots fit the ring's shares (n, angles) best."""
    # A dot that is twice as bright is no more of a dot.
    level = np.minimum(cover / np.maximum(np.quantile(cover, 0.8, axis=1), 1e-6)[:, None], 1.2)
    return np.argmax(level @ _TEMPLATE, axis=1) * (2 * np.pi / _TURNS)


def _dots(pixels: NDArray[np.uint8], middles: Points, mm_per_px: Array, px_per_mm: Array, turn: Array,
          unmix: Array) -> tuple[Points, Array, Array]:
    """Middles of the four dots, (n, 4, 2) mm beside the place; shares of each, (n, 4, 2); mm² a sample, (n,)."""
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    ahead, left = np.array(DOTS_MM).T
    expected = np.stack([c * ahead - s * left, s * ahead + c * left], axis=-1)  # (n, 4, 2) mm
    at = np.rint(middles[:, None] + expected @ px_per_mm.transpose(0, 2, 1))
    scale = np.sqrt(np.abs(np.linalg.det(mm_per_px)))
    half = int(np.ceil(_AROUND_MM / max(float(np.median(scale)), 1e-3))) + 1
    step = max(1, -(-half // _MAX_HALF_PX))
    offsets = np.arange(-half, half + 1, step)
    grid = np.stack(np.meshgrid(offsets, offsets), -1).reshape(-1, 2)
    grid = grid[(grid**2).sum(axis=1) <= (half + 0.5) ** 2]
    share = _sample(pixels, (at[:, :, None] + grid).astype(np.float32), unmix)  # (n, 4, k, 2), of whole pixels
    # A place is the window's middle and a step from there: two small products in place of one for each pixel.
    base = (at - middles[:, None]) @ mm_per_px.transpose(0, 2, 1)
    away = (grid @ mm_per_px.transpose(0, 2, 1)).astype(np.float32)[:, None]  # (n, 1, k, 2)
    off = (base - expected).astype(np.float32)[:, :, None]
    near = ((away + off) ** 2).sum(axis=-1) <= _AROUND_MM**2
    share *= near[..., None]
    weight = share.sum(axis=-1)
    # Grain on the hull weighs a little everywhere, and would pull each middle to the window's.
    weight = np.maximum(weight - 0.25 * weight.max(axis=-1, keepdims=True), 0)
    total = weight.sum(axis=-1, keepdims=True)
    found = base + np.matmul(weight[..., None, :], np.broadcast_to(away, (*weight.shape, 2)))[..., 0, :] / np.maximum(
        total, 1e-9)
    return np.where(total > 1e-6, found, expected), share.sum(axis=2), scale**2 * step**2


def _fitted(dots: Points, there: NDArray[np.bool_]) -> tuple[Points, Array, Array]:
    """The turn and the middle that bring the pattern onto the dots; rms of what is left, mm."""
    n = len(dots)
    model = np.concatenate([np.array(DOTS_MM), np.zeros((1, 2))])
    observed = np.concatenate([dots, np.zeros((n, 1, 2))], axis=1)
    weight = np.concatenate([there.astype(float), np.full((n, 1), _TEAM_WEIGHT)], axis=1)
    total = weight.sum(axis=1)
    from_model = np.einsum("nd,di->ni", weight, model) / total[:, None]
    from_seen = np.einsum("nd,ndi->ni", weight, observed) / total[:, None]
    a, b = model - from_model[:, None], observed - from_seen[:, None]
    dot = (weight * (a * b).sum(-1)).sum(-1)
    cross = (weight * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])).sum(-1)
    turn = np.arctan2(cross, dot)
    c, s = np.cos(turn), np.sin(turn)
    spin = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], axis=-2)
    middle = from_seen - np.einsum("nij,nj->ni", spin, from_model)
    rest = observed - middle[:, None] - np.einsum("nij,dj->ndi", spin, model)
    return middle, turn, np.sqrt((weight * (rest**2).sum(-1)).sum(-1) / total)
