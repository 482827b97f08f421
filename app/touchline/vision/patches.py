"""How far a line has moved across itself since it was seen first, from the brightness across it then and now.

What was seen first, T(u), is its own measure: neither the paint's width nor the model that expected the line there
matters. Now it is brighter or darker, lies in another light, and beside its place by d:

    g(u) = a + b u + c T(u - d)  ≈  a + b u + c T(u) - c d T'(u)

four numbers by least squares, for all places at once. Out of focus it is T made wider by a Gaussian; g is made wider
instead where it was T that was soft.
"""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points
from touchline.vision.profiles import BLUR_PX, FADE_PX, STEP_PX, brightness_across

GROUND_PX = 3.5  # bare ground on either side of the line that takes part
WIDEST_PX = 40.0  # of a line; of a wider one only the middle part would be looked at
# σ by which a picture may be softer than before, or sharper
SOFTER_PX = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
MAX_OFFSET_PX = 1.2  # what four numbers can tell; further away the line has to be looked for first
# of what is not ground and slope, a place that still shows its line explains
MIN_EXPLAINED_SHARE = 0.75
CONTRAST_RATIOS = (0.3, 3.0)  # of the usual: more or less, and something lies on the line
# no place is believed more exactly: grain and compression differ from one to the next
MIN_SIGMA_PX = 0.02
MIN_LEVELS = 3.0  # grey levels
MAX_LEFT_SHARE = 0.7  # of what is left unexplained
FIRST_TRIED_PX = (1.0, -1.0)  # what tells whether the rest is worth a look
MAX_BARE_CONTRAST = 0.12  # of the line's contrast
MAX_LEVEL_SHARE = 0.4  # of the ground's level, which the light may have changed


@dataclass(frozen=True, eq=False)
class LineShifts:
    """(n,) each. px: across the line; sigma_px of it; seen: whether the line is there; gain: contrast now over then.

    left: share of the line's shape that is not explained.
    """

    px: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    seen: NDArray[np.bool_]
    gain: NDArray[np.float64]
    left: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinePatches:
    """Lines at places (n, 2) px with normals (n, 2), as they were seen: rows (n, k) grey levels, away (k,) px."""

    places: Points
    normals: Points
    away: NDArray[np.float64]
    rows: NDArray[np.float64]
    weight: NDArray[np.float64]  # (n, k)
    contrast: NDArray[np.float64]  # (n,) grey levels

    @classmethod
    def of(
        cls, pictures: list[NDArray[np.uint8]], places: Points, normals: Points, width_px: NDArray
    ) -> Self:
        """What most of the pictures agree on."""
        away, half, weight = _window(width_px)
        rows = np.median(
            [_smooth(brightness_across(p, places, normals, away)) for p in pictures], axis=0
        )
        inner = np.abs(away) <= np.maximum(half - 0.5, 0.3)
        outer = (np.abs(away) >= half + 1.5) & (weight > 0.5)
        contrast = np.abs(
            (rows * inner).sum(axis=1) / inner.sum(axis=1)
            - (rows * outer).sum(axis=1) / outer.sum(axis=1)
        )
        return cls(places, normals, away, rows, weight, contrast)

    @classmethod
    def painted(cls, places: Points, normals: Points, width_px: NDArray) -> Self:
        """As paint looks, where no picture tells: bright, and as wide as it should be."""
        away, half, weight = _window(width_px)
        rows = 100 / (1 + np.exp(np.clip((np.abs(away) - half) / (BLUR_PX / 1.702), -40, 40)))
        return cls(places, normals, away, rows, weight, np.full(len(places), 100.0))

    def seen_now(self, picture: NDArray[np.uint8], moved: Points) -> NDArray[np.float64]:
        """(n, k) rows of a picture, where the places have moved by (n, 2) px."""
        return _smooth(brightness_across(picture, self.places + moved, self.normals, self.away))

    def offsets(self, rows: NDArray[np.float64], softer_px: float = 0.0) -> LineShifts:
        """How far these rows' lines are beside their places. softer_px: σ by which they are softer, or sharper."""
        then, now = self.rows, rows
        if softer_px > 0:
            then = _softened(then, softer_px)
        elif softer_px < 0:
            now = _softened(now, -softer_px)
        ground = np.broadcast_to(
            np.stack([np.ones_like(self.away), self.away], axis=-1), (*then.shape, 2)
        )
        slope = np.gradient(then, STEP_PX, axis=1)
        heavy = (
            np.concatenate([ground, then[..., None], -slope[..., None]], axis=2)
            * self.weight[..., None]
        )
        values = (now * self.weight)[..., None]
        scale = np.maximum(np.linalg.norm(heavy, axis=1, keepdims=True), 1e-9)
        inverse = np.linalg.inv(
            (heavy / scale).transpose(0, 2, 1) @ (heavy / scale) + 1e-9 * np.eye(4)
        )
        solved = inverse @ ((heavy / scale).transpose(0, 2, 1) @ values)
        rest = np.sum((values - (heavy / scale) @ solved) ** 2, axis=(1, 2))
        basis, _ = np.linalg.qr(heavy[..., :2])
        # without ground
        shape = np.sum((values - basis @ (basis.transpose(0, 2, 1) @ values))[..., 0] ** 2, axis=1)
        gain, moved = (solved[:, i, 0] / scale[:, 0, i] for i in (2, 3))
        # neighbouring samples share pixels
        freedom = np.maximum((self.weight**2).sum(axis=1) * STEP_PX - 4, 1.0)
        safe = np.where(gain > 1e-3, gain, np.nan)
        with np.errstate(invalid="ignore"):
            px = moved / safe
            sigma = np.sqrt(rest / freedom * inverse[:, 3, 3]) / scale[:, 0, 3] / safe
            left = rest / np.maximum(shape, 1e-9)
            clear = (left < 1 - MIN_EXPLAINED_SHARE) & np.isfinite(safe)
            usual = float(np.median(safe[clear])) if clear.any() else 1.0
            found = (
                clear
                & (np.abs(px) < MAX_OFFSET_PX)
                & (gain > CONTRAST_RATIOS[0] * usual)
                & (gain < CONTRAST_RATIOS[1] * usual)
                & (gain * self.contrast > MIN_LEVELS)
            )
        return LineShifts(px, np.hypot(sigma, MIN_SIGMA_PX), found, gain, left)

    def softness(self, rows: NDArray[np.float64], found: NDArray[np.bool_]) -> float:
        """The σ px by which these rows are softer than they were (negative: sharper); 0 where that explains no more."""
        if not found.any():
            return 0.0

        def left(level: float) -> float:
            return float(np.median(self.offsets(rows, level).left[found]))

        best = min((0.0, *FIRST_TRIED_PX), key=left)
        if best == 0 or left(best) > MAX_LEFT_SHARE * left(0.0):
            return 0.0
        return min((s for s in (*SOFTER_PX, *(-s for s in SOFTER_PX)) if s * best > 0), key=left)

    def bare(self, rows: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(n,) whether a place shows ground without a line: nothing covers it, and the line is not there."""
        total = self.weight.sum(axis=1)
        level = (rows * self.weight).sum(axis=1) / total
        spread = np.sqrt(((rows - level[:, None]) ** 2 * self.weight).sum(axis=1) / total)
        ground = np.percentile(self.rows, 20, axis=1)
        return (spread < MAX_BARE_CONTRAST * self.contrast) & (
            np.abs(level - ground) < MAX_LEVEL_SHARE * ground
        )


def _window(width_px: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Distances (k,) px from the line, half its width (n, 1) px, and what counts (n, k)."""
    half = np.minimum(width_px, WIDEST_PX)[:, None] / 2
    reach = float(half.max(initial=0.5)) + GROUND_PX + 1
    away = np.arange(-np.ceil(reach / STEP_PX), np.ceil(reach / STEP_PX) + 1) * STEP_PX
    return (
        away,
        half,
        1 / (1 + np.exp(np.clip((np.abs(away) - half - GROUND_PX) / (FADE_PX / 2), -40, 40))),
    )


def _smooth(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """A little: derivatives of noise tell nothing."""
    wide = np.pad(rows, ((0, 0), (1, 1)), mode="edge")
    return 0.25 * wide[:, :-2] + 0.5 * wide[:, 1:-1] + 0.25 * wide[:, 2:]


def _softened(rows: NDArray[np.float64], sigma_px: float) -> NDArray[np.float64]:
    wide = 2 * int(np.ceil(3 * sigma_px / STEP_PX)) + 1
    return np.asarray(
        cv2.GaussianBlur(
            rows, (wide, 1), sigmaX=sigma_px / STEP_PX, borderType=cv2.BORDER_REPLICATE
        ),
        np.float64,
    )
