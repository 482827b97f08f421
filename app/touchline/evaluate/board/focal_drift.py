"""Whether the focal length changed while the views were taken: zoom or focus that creeps, slips or was touched.

    c = t · ∂r/∂log f      t: the order of the views, as a step at the middle and as a ramp, each of height 1

What the fit itself could explain of c, poses included, is taken out; the rest of c against the residuals tells the
change. So halves that saw other places of the picture, or other distances, do not count as a change.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.core.geometry import Array
from touchline.evaluate.board.cross_validation import MIN_VIEWS
from touchline.fitting.board.fit import BoardFit

SIGMAS = 5.0  # honest series in any order reach 3.1
MIN_CHANGE = 0.002  # 1 px at a picture's border; of 810 honest orders none shows more than 0.0016


@dataclass(frozen=True)
class FocalDrift:
    """How much longer the focal length is in the second half of the views, as a share of it; NaN with few views."""

    change: float
    sigma: float

    @classmethod
    def of(cls, fit: BoardFit) -> "FocalDrift":
        """Return the step or the ramp over the views' order, whichever stands out more."""
        count = len(fit.observations.pixels)
        if count < MIN_VIEWS:
            return cls(float("nan"), float("nan"))
        order = (np.arange(count) - (count - 1) / 2) / count  # -0.5 to 0.5
        return max((_change(fit, t) for t in (np.sign(order) / 2, 2 * order)), key=lambda d: abs(d.change) / d.sigma)

    @property
    def significant(self) -> bool:
        return abs(self.change) > max(SIGMAS * self.sigma, MIN_CHANGE)

    def to_json(self) -> dict[str, Any]:
        return {"pct": 100 * self.change, "sigma_pct": 100 * self.sigma}


def _change(fit: BoardFit, t: Array) -> FocalDrift:
    """Least squares for one more unknown at the fit's minimum.

    σ: of noise alone, and of the scatter from view to view, which also holds what corners of one view share.
    """
    minimum, views = fit.solution.minimum, len(t)
    reduced = minimum.reduced
    wanted = reduced[..., fit.solution.names.index("log_focal")] * t[:, None]
    known = np.concatenate([reduced.reshape(wanted.size, -1), np.diag(fit.solution.prior)])
    known /= np.linalg.norm(known, axis=0)
    explained = known @ np.linalg.lstsq(known, np.append(wanted.ravel(), np.zeros(known.shape[1])), rcond=None)[0]
    own = wanted - explained[:wanted.size].reshape(wanted.shape)
    power = max(float(np.sum(own**2)), 1e-300)
    residuals = minimum.residuals.reshape(own.shape)
    change = -float(np.sum(own * residuals)) / power
    left = residuals + change * own
    by_chance = np.sum(left**2) / max(fit.solution.freedom - 1, 1) / power
    by_view = np.sum(np.sum(own * left, axis=1) ** 2) / power**2 * views / (views - 1)
    return FocalDrift(change, float(np.sqrt(by_chance + by_view)))
