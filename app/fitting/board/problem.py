"""What a board calibration minimises, and what it knows beforehand: corners against their projections, in σ."""

from dataclasses import dataclass

import numpy as np

from app.core.geometry import Array, ImageSize
from app.fitting.board.least_squares import Blocks, minimise_blocks
from app.fitting.board.parameters import WARP, BoardState, Sights

# So wide that corners decide, and narrow enough that no unknown runs off to infinity. Shares of the picture's width
# and of the board's half diagonal where they are lengths.
WIDE = {"log_focal": 2.0, "aspect": 0.5, "centre": 0.5, "p1": 0.3, "p2": 0.3, "warp": 0.05}
FAR = 0.25  # of the picture's width: the residual of a corner that a lens cannot see
WIDE_TERM = 10.0  # a rational lens has terms of a few units


@dataclass(frozen=True, eq=False)
class BoardProblem:
    """Corners seen, their σ, and which shared unknowns are free (by BoardState.names)."""

    sights: Sights
    free: Array
    image_size: ImageSize
    sigma_px: float

    def solve(self, start: BoardState, *, robust: bool = False, max_steps: int = 50) -> Blocks[BoardState]:
        """The nearest minimum."""
        middle, _ = self._beforehand(start)
        return minimise_blocks(start, self.look, lambda state, shared, own: state.moved(shared, self.free, own),
                               prior=self.prior_of(start), prior_at=lambda state: (state.shared - middle)[self.free],
                               robust=robust, max_steps=max_steps)

    def prior_of(self, state: BoardState) -> Array:
        """1/σ of what is known beforehand of each free unknown."""
        return self._beforehand(state)[1][self.free]

    def look(self, state: BoardState) -> tuple[Array, Array, Array]:
        """Residuals and derivatives in σ; nought where no corner was seen. A lost one costs much and pulls nowhere."""
        with np.errstate(all="ignore"):
            pixels, shared, own = state.project_jacobian(self.sights, self.free)
            residuals = pixels - self.sights.pixels
            lost = ~(np.isfinite(residuals).all(axis=-1) & np.isfinite(shared).all(axis=(-2, -1))
                     & np.isfinite(own).all(axis=(-2, -1)))
        if lost.any():  # beyond this lens's horizon: as far off as can be, and nothing says which way is back
            residuals[lost], shared[lost], own[lost] = FAR * self.image_size.width, 0, 0
        seen = np.where(self.sights.present, 1 / self.sigma_px, 0.0)[..., None]
        residuals *= seen
        shared *= seen[..., None]
        own *= seen[..., None]
        return residuals, shared, own

    def away(self, state: BoardState) -> Array:
        """Residuals in px, (v, m, 2), seen − projected; NaN where no corner is, or none can be projected."""
        with np.errstate(all="ignore"):
            return np.where(self.sights.present[..., None], self.sights.pixels - state.project(self.sights), np.nan)

    def _beforehand(self, state: BoardState) -> tuple[Array, Array]:
        """The values that shared unknowns are thought to have, and 1/σ of that."""
        middle, loose = [], []
        for name in state.names:
            if name == "log_focal":
                known = float(np.log(self.image_size.width)), WIDE[name]
            elif name == "aspect":
                known = 1.0, WIDE[name]
            elif name.startswith("centre"):
                known = self.image_size.centre[name == "centre_y"], WIDE["centre"] * self.image_size.width
            elif name in WARP:
                known = 0.0, WIDE["warp"] * self.sights.size_mm
            else:
                known = 0.0, WIDE.get(name, WIDE_TERM)
            middle.append(known[0])
            loose.append(1 / known[1])
        return np.array(middle), np.array(loose)


def free_mask(state: BoardState, terms: tuple[str, ...], *, aspect: bool, centre: bool, warp: bool) -> Array:
    """Which of state.names are estimated."""
    free = {"log_focal", *terms}
    free |= {"aspect"} if aspect else set()
    free |= {"centre_x", "centre_y"} if centre else set()
    free |= set(WARP) if warp else set()
    return np.array([name in free for name in state.names])
