"""Snaps a click to the painted line beside it: both edges at sub-pixel, and the line's middle between them.

Grey across a line is a bar seen through blur,
    I(s, t) = b₁ + (p - b₁) Φ((d + w/2)/σ) + (b₂ - p) Φ((d - w/2)/σ) + g s,    d = t - (c₀ + c₁ s + c₂ s²),
s px along the line and t across it from the click, with a background of its own on either side. All of it is fitted
at once to the pixels themselves, so that nothing is interpolated; what does not belong (a crossing line, a robot's
shadow) counts little (Tukey's biweight). Two edges less than a blur apart leave width and brightness exchangeable;
the middle between them stays known.

The middle is what a field's drawing means by the line's position (see field.py). A click moves only across the line.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import Points, normal_cdf
from touchline.vision.line_search import ALONG_PX, SIDE_PX, LineBar, find_line_bar

REACH_PX = 10.0
WIDTHS_PX = (1.0, 20.0)  # of a line of unknown width
# how wrong a given width may be: it is known from a rough scale, and tape is laid by hand
WIDTH_RATIOS = (1 / 3, 3.0)
TURN_RAD = np.radians(15)  # how wrong a given direction may be
BESIDE_PX = 5.0  # background that is fitted on either side
BLUR_PX, BLUR_RATIO = 0.8, 1.6  # a camera in focus, and one standard deviation of it as a factor
BEND = 1 / 80  # per px, one standard deviation: a small circle's curvature
STEPS, MAX_TURNS = 15, 3
STILL_PX = 2e-3
CUT = 4.0  # times the residuals' scale: beyond, a pixel shows something else
MIN_NOISE = 0.7  # grey levels: rounding, and the least of a camera
MIN_EXPLAINED = 0.45  # of the pixels and their variance: less is no line
CLEAR = 3.0  # times the noise by which both edges must stand out
MIN_EDGE = 5.0  # grey levels
UNSURE_PX = 0.3
BACKGROUND_PX = 1.2  # that must be seen beside either edge, as near the picture's end it may not be


@dataclass(frozen=True)
class Hint:
    """What is known before: how far the line may be, its width in px, the direction it runs in (radians, mod π)."""

    reach_px: float = REACH_PX
    width_px: float | None = None
    angle_rad: float | None = None


@dataclass(frozen=True)
class Snapped:
    """The middle of the line beside the click, raw px; sigma_px: how well the pixels tell it, across the line.

    confidence: what share of the pixels around it fit a line, times the share of their variance it explains.
    """

    point: tuple[float, float]
    moved_px: float
    width_px: float
    angle_rad: float  # in [0, π)
    sigma_px: float
    confidence: float


@dataclass(frozen=True)
class Unsnapped:
    """Why a click stays where it is: reason is no-line, one-edge, unclear or off-picture."""

    reason: str


REASONS = {
    "no-line": "no line within reach",
    "one-edge": "only one edge of the line detected",
    "unclear": "no clear line",
    "off-picture": "outside the image",
}


def snap(pixels: NDArray[np.uint8], point: Points, hint: Hint = Hint()) -> Snapped | Unsnapped:
    """The middle of the line that a click (2,) px means, in a picture (h, w) or (h, w, 3)."""
    height, width = pixels.shape[:2]
    x, y = float(point[0]), float(point[1])
    if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):  # NaN is not inside
        return Unsnapped("off-picture")
    widths = (
        WIDTHS_PX
        if hint.width_px is None
        else (WIDTH_RATIOS[0] * hint.width_px, max(WIDTH_RATIOS[1] * hint.width_px, 3.0))
    )
    middle = np.rint([x, y])
    half = int(np.ceil(np.hypot(hint.reach_px + widths[1] + SIDE_PX + 2, ALONG_PX)))
    patch = _patch(pixels, middle.astype(int), half)
    away = np.array([x, y]) - middle
    bar = find_line_bar(patch, away, hint.reach_px, widths, hint.angle_rad, TURN_RAD)
    if isinstance(bar, str):
        return Unsnapped(bar)
    return _refined(patch, away, np.array([x, y]), bar, hint, widths)


def _patch(pixels: NDArray, middle: NDArray, half: int) -> NDArray[np.float64]:
    """A square around a pixel, grey; NaN beyond the picture."""
    x, y = middle
    left, top = max(0, half - x), max(0, half - y)
    window = opencv.to_grey(
        np.ascontiguousarray(
            pixels[max(0, y - half) : y + half + 1, max(0, x - half) : x + half + 1]
        )
    )
    patch = np.full((2 * half + 1, 2 * half + 1), np.nan)
    patch[top : top + window.shape[0], left : left + window.shape[1]] = window
    return patch


def _refined(
    patch: NDArray,
    away: NDArray,
    click: NDArray,
    bar: LineBar,
    hint: Hint,
    widths: tuple[float, float],
) -> Snapped | Unsnapped:
    """Fit, turn to the line's own direction, fit again: at the foot the line then runs along s."""
    angle, start, turns = bar.angle_rad, (bar.offset_px, bar.width_px), 0
    while True:
        fitted = _fit(patch, away, angle, start, bar, hint.width_px)
        if fitted is None:
            return Unsnapped("unclear")
        turn = float(np.arctan(fitted.slope))
        angle, start, turns = (
            angle + turn,
            (fitted.offset_px * np.cos(turn), fitted.width_px),
            turns + 1,
        )
        if abs(turn) < 0.01 or turns == MAX_TURNS:
            break
    if (
        abs(fitted.offset_px) > hint.reach_px + 1
        or not 0.5 * widths[0] <= fitted.width_px <= 1.3 * widths[1]
    ):
        return Unsnapped("no-line")
    edges = fitted.edges
    if edges[0] * edges[1] > 0:
        return Unsnapped("one-edge")
    if (
        min(np.abs(edges)) < max(MIN_EDGE, CLEAR * fitted.noise)
        or fitted.explained < MIN_EXPLAINED
        or fitted.beside_px < BACKGROUND_PX
        or not fitted.sigma_px <= UNSURE_PX
    ):
        return Unsnapped("unclear")
    offset = fitted.offset_px
    foot = click + offset * np.array([-np.sin(angle), np.cos(angle)])
    return Snapped(
        (float(foot[0]), float(foot[1])),
        abs(float(offset)),
        fitted.width_px,
        float(angle % np.pi),
        fitted.sigma_px,
        fitted.explained,
    )


@dataclass(frozen=True)
class _Fitted:
    offset_px: float
    slope: float
    width_px: float
    edges: tuple[float, float]  # grey levels by which it rises at its first edge, and at its second
    beside_px: float  # the lesser background that was seen
    noise: float
    sigma_px: float
    explained: float


def _fit(
    patch: NDArray,
    away: NDArray,
    angle: float,
    start: tuple[float, float],
    bar: LineBar,
    expected_px: float | None,
) -> _Fitted | None:
    """Gauss-Newton with biweights. Unknowns: c₀ c₁ c₂ w ln σ b₁ p b₂ g."""
    s, t, grey = _around(patch, away, angle, start[0], bar)
    if len(grey) < 30:
        return None
    width = start[1]
    inner = np.abs(t - start[0]) < max(width / 2, 0.7)
    # Clear of the blur, or the outermost pixels where the picture ends before that.
    before = t < max(start[0] - width / 2 - 1, t.min() + 0.7)
    after = t > min(start[0] + width / 2 + 1, t.max() - 0.7)
    if not inner.any():
        return None
    levels = [np.median(grey[where]) for where in (before, inner, after)]
    if expected_px is not None and not 0.5 <= expected_px / max(width, 1.0) <= 2:
        # what is seen is plainly wider, or thinner: tape is not always what the rules say
        expected_px = None
    state = np.array([start[0], 0.0, 0.0, expected_px or width, np.log(BLUR_PX), *levels, 0.0])
    prior = state.copy()
    spread = np.array(
        [
            np.inf,
            np.inf,
            BEND / 2,
            0.4 * expected_px if expected_px else 0.5 * width + 0.5,
            np.log(BLUR_RATIO),
            np.inf,
            max(30.0, abs(levels[1] - (levels[0] + levels[2]) / 2)),
            np.inf,
            np.inf,
        ]
    )
    free = np.isfinite(spread)
    for _ in range(STEPS):
        shown, jacobian = _bar_seen(state, s, t)
        residual = grey - shown
        noise = max(MIN_NOISE, 1.4826 * float(np.median(np.abs(residual))))
        weight = np.clip(1 - (residual / (CUT * noise)) ** 2, 0, None)
        rows = jacobian * weight[:, None]
        normal = rows.T @ rows / noise**2
        right = rows.T @ (weight * residual) / noise**2
        normal[free, free] += spread[free] ** -2
        right[free] -= (state - prior)[free] / spread[free] ** 2
        normal[np.diag_indices(9)] *= 1 + 1e-6
        try:
            delta = np.linalg.solve(normal, right)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(delta).all():
            return None
        longest = np.max(np.abs(delta[[0, 1, 3, 4]]) * (1.0, ALONG_PX, 0.5, 2.0))
        shorten = 1.0 / max(1.0, longest)
        state = state + shorten * delta
        state[3], state[4] = max(state[3], 0.3), np.clip(state[4], np.log(0.3), np.log(4.0))
        if np.abs(delta[0]) < STILL_PX and np.abs(delta[1]) * ALONG_PX < STILL_PX:
            break
    residual = grey - _bar_seen(state, s, t)[0]
    fits = np.abs(residual) < CUT * noise
    of_grey = float(np.sum((grey[fits] - grey[fits].mean()) ** 2)) if fits.any() else 0.0
    explained = (
        (1 - float(np.sum(residual[fits] ** 2)) / of_grey) * float(fits.mean())
        if of_grey > 0
        else 0.0
    )
    with np.errstate(invalid="ignore"):
        sigma = float(np.sqrt(np.linalg.inv(normal)[0, 0]))
    edges = float(state[6] - state[5]), float(state[7] - state[6])
    beside = float(min(state[0] - t.min(), t.max() - state[0]) - state[3] / 2)
    return _Fitted(
        float(state[0]),
        float(state[1]),
        float(state[3]),
        edges,
        beside,
        noise,
        sigma,
        float(np.clip(explained, 0, 1)),
    )


def _around(
    patch: NDArray, away: NDArray, angle: float, offset: float, bar: LineBar
) -> tuple[NDArray, NDArray, NDArray]:
    """Pixels on the line and the background beside it: s and t from the click, and their grey."""
    half = patch.shape[0] // 2
    side = np.arange(-half, half + 1)
    x, y = side[None, :] - away[0], side[:, None] - away[1]
    s, t = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    # Background, until something else begins.
    before, after = (min(room, bar.width_px / 2 + BESIDE_PX) for room in bar.rooms_px)
    near = (
        (np.abs(s) <= ALONG_PX)
        & (t >= offset - before)
        & (t <= offset + after)
        & np.isfinite(patch)
    )
    return s[near], t[near], patch[near]


def _bar_seen(state: NDArray, s: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
    """Grey (n,) of a blurred bar, and its derivatives (n, 9)."""
    c0, c1, c2, width, log_blur, b1, p, b2, g = state
    blur = np.exp(log_blur)
    d = t - (c0 + c1 * s + c2 * s**2)
    z1, z2 = (d + width / 2) / blur, (d - width / 2) / blur
    rise1, rise2 = normal_cdf(z1), normal_cdf(z2)
    slope1, slope2 = (
        (level * np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi))
        for level, z in ((p - b1, z1), (b2 - p, z2))
    )
    by_d = (slope1 + slope2) / blur
    columns = (
        -by_d,
        -by_d * s,
        -by_d * s**2,
        (slope1 - slope2) / (2 * blur),
        -(slope1 * z1 + slope2 * z2),
        1 - rise1,
        rise1 - rise2,
        rise2,
        s,
    )
    return b1 + (p - b1) * rise1 + (b2 - p) * rise2 + g * s, np.stack(columns, axis=1)
