"""Controls of a simulated camera, as a real one has them, and two mishaps of real ones: a knock and lost focus.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from touchline.core.geometry import ImageSize
from touchline.sources import Control
from touchline.sources.control_errors import is_number, refused_value, unknown_control
from touchline.sources.sim.render import USUAL_EXPOSURE_MS, Shot

BINNINGS = (1, 2, 4)
NEUTRAL_K = 5000.0
AUTO_LEVEL = 110.0  # mean grey level that an automatic exposure aims at
MIN_EXPOSURE_US, MAX_GAIN_DB, RATES_HZ, KELVINS = 20.0, 24.0, (0.1, 240.0), (2500.0, 10_000.0)
NUMBERS = {"exposure": "exposure_us", "gain": "gain_db", "white_balance": "white_balance_k", "knock": "knock_px",
           "softer": "softer_px", "frame_rate": "frame_rate"}  # controls that are numbers, and their attributes
KNOCKS_PX, SOFTER_PX = (-200.0, 200.0), (0.0, 5.0)


@dataclass
class Settings:
    """The camera's settings. size: at full resolution."""

    size: ImageSize
    frame_rate: float
    exposure_us: float = 1000 * USUAL_EXPOSURE_MS
    auto_exposure: bool = False
    gain_db: float = 0.0
    white_balance_k: float = NEUTRAL_K
    binning: int = 1
    knock_px: float = 0.0
    softer_px: float = 0.0

    def shot(self, level: Callable[[Shot], float]) -> Shot:
        """Return what the next frame is taken with. level: computes a shot's mean grey level."""
        warm = (self.white_balance_k / NEUTRAL_K) ** 0.5
        gain, tint = 10 ** (self.gain_db / 20), (1 / warm, 1.0, warm)
        longest_us = 1e6 / self.frame_rate
        if self.auto_exposure:
            one_ms = Shot(1.0, gain, tint)
            aimed_us = 1000 * AUTO_LEVEL / max(level(one_ms), 1e-6)
            self.exposure_us = min(max(aimed_us, MIN_EXPOSURE_US), longest_us)
        self.exposure_us = min(self.exposure_us, longest_us)
        return Shot(self.exposure_us / 1000, gain, tint)

    def controls(self) -> tuple[Control, ...]:
        return (
            Control("exposure", "Exposure time", "float", self.exposure_us, "µs",
                    (MIN_EXPOSURE_US, 1e6 / self.frame_rate), (), self.auto_exposure),
            Control("gain", "Gain", "float", self.gain_db, "dB", (0.0, MAX_GAIN_DB)),
            Control("white_balance", "White balance", "float", self.white_balance_k, "K", KELVINS),
            Control("resolution", "Resolution", "choice", self._text(self.binning), "px", None,
                    tuple(self._text(n) for n in self._binnings)),
            Control("frame_rate", "Frame rate", "float", self.frame_rate, "Hz", RATES_HZ),
            Control("knock", "Move the camera: rotate it to the side", "float", self.knock_px, "px", KNOCKS_PX),
            Control("softer", "Defocus the lens", "float", self.softer_px, "px", SOFTER_PX),
        )

    def set(self, name: str, value: Any) -> Control:
        """Set one; NotFound for an unknown name, BadInput for a value that it cannot have."""
        control = self._control(name)
        if value == "auto" and control.automatic is not None:
            self.auto_exposure = True
        elif control.range is None:  # a choice
            if value not in control.choices:
                raise refused_value(control.label, repr(str(value)[:40]), " or ".join(control.choices))
            self.binning = self._binnings[control.choices.index(value)]
        else:
            low, high = control.range
            if not is_number(value, low, high):
                other = ', or "auto"' if control.automatic is not None else ""
                raise refused_value(control.label, repr(str(value)[:40]), f"a number from {low:g} to {high:g}{other}")
            setattr(self, NUMBERS[name], float(value))
            if name == "exposure":
                self.auto_exposure = False
            self.exposure_us = min(self.exposure_us, 1e6 / self.frame_rate)  # no exposure is longer than a frame
        return self._control(name)

    def _control(self, name: str) -> Control:
        table = {control.name: control for control in self.controls()}
        if name not in table:
            raise unknown_control(name, table)
        return table[name]

    @property
    def _binnings(self) -> list[int]:
        w, h = self.size
        return [n for n in BINNINGS if w % n == h % n == 0 and min(w, h) // n >= 32]

    def _text(self, binning: int) -> str:
        return f"{self.size.width // binning}x{self.size.height // binning}"
