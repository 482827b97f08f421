"""In a camera's process: about twice a second, how light and focus are, on a reduced picture.

Flicker needs frames that follow each other: every FLICKER_EVERY_S a burst of them is looked at, rows only.
"""

import time

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.geometry import ImageSize, inside_picture
from touchline.core.statements import say
from touchline.live.capture import CapturedFrame, FrameCapture
from touchline.live.encoder import Encoder
from touchline.live.failures import Failures
from touchline.live.status_types import PictureQuality
from touchline.vision.picture_print import PicturePrint
from touchline.vision.quality import flicker, light, sharpness
from touchline.vision.quality.stillness import Stillness

EVERY_S = 0.5
FLICKER_EVERY_S = 8.0
BURST = 32  # frames, about a second of them
BURST_S = 4.0  # a slow camera's burst ends here, whatever it has
WIDTH_PX = 640


class QualityMonitor:
    """The thread that looks at light and focus. It gives way: it sleeps much longer than it works."""

    def __init__(self, capture: FrameCapture, encoder: Encoder, failures: Failures) -> None:
        self._capture = capture
        self._encoder = encoder
        self._failures = failures
        self._stillness = Stillness()
        self._flicker: flicker.Flicker | None = None
        self._mask: tuple[str, ImageSize, NDArray[np.bool_]] | None = None
        self.newest: PictureQuality | None = None

    def run(self) -> None:
        """Work until the process ends, on a thread of its own."""
        seq, due = 0, time.monotonic()
        while True:
            with self._failures.surviving(say("camera-failure.quality", "Light and focus are not evaluated")):
                if time.monotonic() >= due and not self._capture.resting:
                    due = time.monotonic() + FLICKER_EVERY_S
                    self._flicker = self._burst(seq) or self._flicker
                taken = self._capture.after(seq, EVERY_S, in_passing=True)
                if taken is not None:
                    seq = taken.seq
                    self.newest = self._look(opencv.shrink_to_width(taken.frame.pixels, WIDTH_PX), taken)
            time.sleep(EVERY_S)

    def _look(self, small: NDArray[np.uint8], taken: CapturedFrame) -> PictureQuality:
        still = self._stillness.add(small, taken.moment)
        field = self._field_of(small.shape[1], small.shape[0], taken.frame.size)
        found_light = light.measure_light(small, field)
        found_sharpness = sharpness.measure_sharpness(taken.frame.pixels, field)  # reduced, a soft edge looks sharp
        words = [*light.advice(found_light), *sharpness.advice(found_sharpness), *flicker.advice(self._flicker)]
        words.sort(key=lambda word: word["severity"] != "warning")
        found_print = PicturePrint.of(small)
        return {"still": still, "light": found_light.to_json(),
                "sharpness": found_sharpness.to_json(), "words": words, "flicker": self._flicker,
                "print": None if found_print is None else found_print.to_text()}

    def _burst(self, seq: int) -> flicker.Flicker | None:
        times, rows = list[float](), list[NDArray[np.float32]]()
        end = time.monotonic() + BURST_S
        while len(times) < BURST and time.monotonic() < end:
            taken = self._capture.after(seq, EVERY_S, in_passing=True)
            if taken is None:
                break
            seq = taken.seq
            row = flicker.row_means(taken.frame.reduced(1, flicker.MAX_ROWS))
            if rows and len(row) != len(rows[0]):
                break
            times.append(taken.moment)
            rows.append(row)
        return flicker.measure_flicker(times, rows)

    def _field_of(self, width: int, height: int, raw: ImageSize) -> NDArray[np.bool_] | None:
        """Return where the field lies in the reduced picture; None where no calibration says."""
        applied = self._encoder.calibration
        if applied is None or applied.record.image_size != raw:
            return None
        if self._mask is None or self._mask[:2] != (applied.record.id, raw):
            x, y = np.meshgrid(np.arange(width), np.arange(height))
            points = np.stack([(x + 0.5) * raw.width / width - 0.5, (y + 0.5) * raw.height / height - 0.5], axis=-1)
            corrected = applied.model.corrected_from_raw(points.reshape(-1, 2)).reshape(height, width, 2)
            self._mask = applied.record.id, raw, inside_picture(corrected, applied.model.corrected_size, 0)
        return self._mask[2]
