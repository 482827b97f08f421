"""What views say that a lens had not seen: each fifth is left out in turn, and both halves give a lens of their own.

Held-out residuals see a wrong model and too few views. They are nearly blind to views that are badly spread, for a
pose takes up much of a lens's error; two lenses from two halves see that, where they disagree over the picture.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.core.geometry import Mask
from touchline.fitting.board.fit import BoardFit
from touchline.models.lens_difference import lens_difference

FOLDS = 5
MIN_VIEWS = 6  # views: halves of three are the least that make a lens


@dataclass(frozen=True)
class CrossValidation:
    """held_px: of one coordinate of a corner in a left-out view. halves_px: median over the picture of how far two
    lenses from half the views each differ, halved: what the whole set's lens may be off. NaN where there are too few
    views."""

    held_px: float
    held_ratio: float  # to the residual σ
    halves_px: float
    halves_ratio: float

    def to_json(self) -> dict[str, Any]:
        return {"held_out_px": self.held_px, "held_out_ratio": self.held_ratio, "halves_px": self.halves_px,
                "halves_ratio": self.halves_ratio}


def cross_validate(fit: BoardFit) -> CrossValidation:
    """Fit again without some views; nothing is chosen anew."""
    count = len(fit.observations.pixels)
    if count < MIN_VIEWS:
        return CrossValidation(*[float("nan")] * 4)
    turn = np.arange(count)
    held = [_held_squares(fit, turn % FOLDS == fold) for fold in range(FOLDS)]
    squares, freedom = np.sum(held, axis=0)
    held_px = float(np.sqrt(squares / max(freedom, 1)))
    first, second = (fit.refit(turn % 2 == half).minimum.state.lens_of(fit.lens.model, fit.lens.image_size)
                     for half in (0, 1))
    halves_px = float(np.nanmedian(np.linalg.norm(lens_difference(first, second), axis=-1))) / 2
    sigma = max(fit.sigma_px, 1e-9)
    return CrossValidation(held_px, held_px / sigma, halves_px, halves_px / sigma)


def _held_squares(fit: BoardFit, held: Mask) -> tuple[float, float]:
    """Sum of squares, px², and degrees of freedom of views that the lens had not seen; only their poses are free."""
    without = fit.refit(~held).minimum.state
    start = fit.state.only(held).with_shared(without.shared)
    solved = fit.solver.poses(fit.observations.only(held), start, fit.sigma_px)
    squares = float(np.sum(solved.residuals**2)) * fit.sigma_px**2
    return squares, 2 * float(fit.observations.present[held].sum()) - 6 * float(held.sum())
