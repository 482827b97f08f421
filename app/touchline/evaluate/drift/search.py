"""Search for lines further away: which shift of the whole picture finds most of them.

For every distance across its line, each place has a likeness to what was seen there before. A shift of the
picture moves each place by what it is across the line: the shift on which most places agree is where the picture went.
"""

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Array
from touchline.fitting.image_motion import estimate_motion
from touchline.vision.patches import LinePatches
from touchline.vision.profiles import brightness_across

REACH = 0.08  # of the picture's width
MIN_REACH_PX, MAX_REACH_PX = 16, 120
STEP_PX = 2  # of the shifts tried
SLACK_PX = 2  # by which a place may disagree: a turn, a lens
LIKE = 0.75  # correlation that counts
NEAR_PX = 6  # about the shift, each place's own best is looked for
SIGMA_PX = 1.0
MIN_PLACES = 8


def best_motion(patches: LinePatches, across: Array, picture: NDArray[np.uint8]) -> Array | None:
    """q (4,) of the motion that finds most lines again, to a pixel or so; None where none does.

    across (n, 4): n · B of each place.
    """
    reach = int(np.clip(REACH * picture.shape[1], MIN_REACH_PX, MAX_REACH_PX))
    like = _likeness(patches, picture, reach)
    near = np.max([np.roll(like, s, axis=1) for s in range(-SLACK_PX, SLACK_PX + 1)], axis=0)
    steps = np.arange(-reach, reach + 1, STEP_PX)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    off = np.rint(shifts @ patches.normals.T).astype(int)  # (m, n)
    inside = np.abs(off) <= reach
    score = np.where(inside, near[np.arange(len(near)), np.clip(off, -reach, reach) + reach], 0.0).sum(axis=1)
    best = shifts[int(np.argmax(score))] @ patches.normals.T
    away = np.arange(-reach, reach + 1)
    own = np.where(np.abs(away - best[:, None]) <= NEAR_PX, like, 0.0)
    found = own.max(axis=1) > 0
    if found.sum() < MIN_PLACES:
        return None
    own_off = away[own.argmax(axis=1)].astype(float)
    return estimate_motion(across[found], own_off[found], np.full(int(found.sum()), SIGMA_PX)).q


def _likeness(patches: LinePatches, picture: NDArray[np.uint8], reach: int) -> NDArray[np.float64]:
    """(n, 2 reach + 1) how well what was seen correlates with what is there now, a pixel apart; nought if hardly."""
    then = patches.rows[:, patches.away % 1 == 0]
    weight = patches.weight[:, patches.away % 1 == 0]
    half = (then.shape[1] - 1) // 2
    away = np.arange(-reach - half, reach + half + 1).astype(float)
    now = brightness_across(picture, patches.places, patches.normals, away)
    windows = np.lib.stride_tricks.sliding_window_view(now, then.shape[1], axis=1)  # (n, 2 reach + 1, k)
    total = weight.sum(axis=1)
    mean = np.einsum("nsk,nk->ns", windows, weight) / total[:, None]
    then = (then - (then * weight).sum(axis=1, keepdims=True) / total[:, None])
    dot = np.einsum("nsk,nk->ns", windows, then * weight)
    square = np.einsum("nsk,nsk,nk->ns", windows, windows, weight) - mean**2 * total[:, None]
    own = np.sum(then**2 * weight, axis=1)[:, None]
    like = dot / np.sqrt(np.maximum(square, 1e-6) * np.maximum(own, 1e-9))
    strong = square > 0.04 * own  # a fifth of the contrast at least: noise may look like anything
    return np.where(strong & (like > LIKE), like, 0.0)
