"""Light that changes over time: mains flicker, and a slow drift as of clouds before a window.

A lamp on the mains shines 1 + flicker · sin(2π f t). A sensor adds that up while it is exposed, which damps it by
sinc(f · exposure): to nothing when the exposure is a whole number of flickers. With a rolling shutter each row is
exposed a little later than the one above, so that the flicker stands in the picture as bands.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DRIFT_PERIOD_S = 60.0


@dataclass(frozen=True)
class Lamps:
    """flicker, drift: shares of the light, 0…1, up and down."""

    flicker: float = 0.0
    flicker_hz: float = 100.0
    drift: float = 0.0

    def brightness(self, time_s: NDArray | float, exposure_s: float) -> NDArray | float:
        """Return the mean light from time_s - exposure_s / 2 to time_s + exposure_s / 2, 1 where nothing changes."""
        damped = self.flicker * np.sinc(self.flicker_hz * exposure_s)
        return ((1 + damped * np.sin(2 * np.pi * self.flicker_hz * np.asarray(time_s)))
                * (1 + self.drift * np.sin(2 * np.pi * np.asarray(time_s) / DRIFT_PERIOD_S)))
