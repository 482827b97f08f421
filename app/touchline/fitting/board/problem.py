"""What a board calibration minimises: distances of corners from their projections in σ, and wide priors."""

from dataclasses import dataclass

import numpy as np

from touchline.core.geometry import Array, ImageSize, Mask
from touchline.fitting.board.least_squares import BlockMinimum, minimise_blocks
from touchline.fitting.board.parameters import WARP, BoardObservations, BoardParameters

# So wide that corners decide, and narrow enough that no unknown runs off to infinity. Shares of the picture's width
# and of the board's half diagonal where they are lengths.
WIDE = {"log_focal": 2.0, "aspect": 0.5, "centre": 0.5, "p1": 0.3, "p2": 0.3, "warp": 0.05}
FAR = 0.25  # of the picture's width: the residual of a corner that a lens cannot see
WIDE_TERM = 10.0  # a rational lens has terms of a few units


@dataclass(frozen=True, eq=False)
class BoardProblem:
    """Corners, their σ, and which shared unknowns are free (by BoardParameters.names)."""

    observations: BoardObservations
    free: Mask
    image_size: ImageSize
    sigma_px: float

    def solve(self, start: BoardParameters, *, robust: bool = False,
              max_steps: int = 50) -> BlockMinimum[BoardParameters]:
        """Find the nearest minimum."""
        middle, _ = self._prior(start)
        return minimise_blocks(start, self.linearise, lambda state, shared, own: state.retract(shared, self.free, own),
                               prior=self.prior_of(start), prior_at=lambda state: (state.shared - middle)[self.free],
                               robust=robust, max_steps=max_steps)

    def prior_of(self, state: BoardParameters) -> Array:
        """Return 1/σ of the prior of each free unknown."""
        return self._prior(state)[1][self.free]

    def linearise(self, state: BoardParameters) -> tuple[Array, Array, Array]:
        """Return residuals and derivatives in σ, 0 where there is no corner; beyond the horizon there is no slope."""
        with np.errstate(all="ignore"):
            pixels, shared, own = state.project_jacobian(self.observations, self.free)
            residuals = pixels - self.observations.pixels
            lost = ~(np.isfinite(residuals).all(axis=-1) & np.isfinite(shared).all(axis=(-2, -1))
                     & np.isfinite(own).all(axis=(-2, -1)))
        if lost.any():  # beyond this lens's horizon: a large residual without a direction
            residuals[lost], shared[lost], own[lost] = FAR * self.image_size.width, 0, 0
        weight = np.where(self.observations.present, 1 / self.sigma_px, 0.0)[..., None]
        residuals *= weight
        shared *= weight[..., None]
        own *= weight[..., None]
        return residuals, shared, own

    def residuals_px(self, state: BoardParameters) -> Array:
        """Return residuals (v, m, 2) px, observed − projected; NaN where no corner is, or it cannot be projected."""
        with np.errstate(all="ignore"):
            residuals = self.observations.pixels - state.project(self.observations)
            return np.where(self.observations.present[..., None], residuals, np.nan)

    def _prior(self, state: BoardParameters) -> tuple[Array, Array]:
        """Return the mean and 1/σ of the shared unknowns' priors."""
        middle, loose = [], []
        for name in state.names:
            if name == "log_focal":
                known = float(np.log(self.image_size.width)), WIDE[name]
            elif name == "aspect":
                known = 1.0, WIDE[name]
            elif name.startswith("centre"):
                known = self.image_size.centre[name == "centre_y"], WIDE["centre"] * self.image_size.width
            elif name in WARP:
                known = 0.0, WIDE["warp"] * self.observations.size_mm
            else:
                known = 0.0, WIDE.get(name, WIDE_TERM)
            middle.append(known[0])
            loose.append(1 / known[1])
        return np.array(middle), np.array(loose)


def free_mask(state: BoardParameters, terms: tuple[str, ...], *, aspect: bool, centre: bool, warp: bool) -> Mask:
    """Return which of state.names are estimated."""
    free = ("log_focal", *terms, *(("aspect",) if aspect else ()), *(("centre_x", "centre_y") if centre else ()),
            *(WARP if warp else ()))
    return np.array([name in free for name in state.names])
