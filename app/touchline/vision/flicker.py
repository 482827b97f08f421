"""Whether the light flickers, from a short series of frames: as a whole, and as bands that a rolling shutter makes.

Lamps on the mains flicker 100 or 120 times a second. A camera sees that slowed down, by the beat with its own frame
rate, and, if it reads its rows one after the other, as bands that wander up or down the picture. A beat of nothing, as
of 100 Hz lamps at 25 frames a second, stands still: it looks like uneven light, and no series of frames can tell.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.statements import join, say
from touchline.vision.zones import Advice, message

MAINS_HZ = (100.0, 120.0)
MIN_FRAMES = 12
MAX_ROWS = 270
SEEN_PCT, MUCH_PCT = 1.0, 4.0  # moving robots make up to half a per cent
_PURE = 0.5  # of the variance must be one frequency's, for it to be named
_TURNS = 24.0  # bands: as many per picture at most
_SLOW = 0.5  # and at least so many, less is a change of the light's place


class Flicker(TypedDict):
    """amplitude_pct: of the whole picture's brightness, up and down. beat_hz: how often, as the camera sees it; None
    where no one frequency stands out. bands_pct: of the rows beside each other; bands: how many in the picture.
    lamp_hz: 100 or 120 where the beat fits just one of them. drift_pct: slow change over the whole series.
    """

    amplitude_pct: float
    beat_hz: float | None
    bands_pct: float
    bands: float | None
    lamp_hz: float | None
    drift_pct: float
    frames: int


def row_means(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Mean brightness (n,) of bundles of rows, at most 270 of them, from every eighth column."""
    rows = max(1, -(-picture.shape[0] // MAX_ROWS))
    part = picture[: picture.shape[0] // rows * rows, ::8]
    means = cv2.reduce(part.reshape(part.shape[0], -1), 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F)
    return means.reshape(-1, rows).mean(axis=1)


def measure_flicker(times_s: Sequence[float], rows: Sequence[NDArray]) -> Flicker | None:
    """Measure a series: when each frame was taken, and its row means (n,). None for fewer than 12 frames."""
    times, brightness = np.asarray(times_s, float), np.asarray(rows, float)
    usable = (
        np.isfinite(times) & np.isfinite(brightness).all(axis=1)
        if len(brightness)
        else np.empty(0, bool)
    )
    times, brightness = times[usable], brightness[usable]
    if len(times) < MIN_FRAMES or np.ptp(times) <= 0 or brightness.mean() <= 0:
        return None
    times = times - times[0]
    level = brightness.mean(axis=1) / brightness.mean()
    slope, start = np.polyfit(times, level, 1)
    amplitude, beat = _strongest(times, level - start - slope * times)
    bands_pct, bands, band_beat = _bands(times, brightness)
    if max(100 * amplitude, bands_pct) < SEEN_PCT:
        beat = bands = band_beat = None
    named = band_beat if bands_pct > 100 * amplitude else beat
    return {
        "amplitude_pct": round(100 * amplitude, 2),
        "beat_hz": None if beat is None else round(beat, 2),
        "bands_pct": round(bands_pct, 2),
        "bands": bands,
        "lamp_hz": _lamp(named, times),
        "drift_pct": round(float(100 * slope * times[-1]), 2),
        "frames": len(times),
    }


def _frequencies(times: NDArray) -> NDArray:
    """What the series can tell apart: from one turn over its length to half its frame rate."""
    rate = 1 / np.median(np.diff(times))
    return np.arange(1 / np.ptp(times), rate / 2 * 1.001, 0.1 / np.ptp(times))


def _strongest(times: NDArray, off: NDArray) -> tuple[float, float | None]:
    """Amplitude of what wavers about zero, and its frequency where one stands out."""
    waves = np.exp(-2j * np.pi * _frequencies(times)[:, None] * times)
    # of the sum of squares, what this frequency explains
    power = np.abs(waves @ off) ** 2 * 2 / len(times)
    total = float((off**2).sum())
    best = int(power.argmax())
    pure = total > 0 and power[best] > _PURE * total
    return float(np.sqrt(2 * np.mean(off**2))), float(_frequencies(times)[best]) if pure else None


def _bands(times: NDArray, brightness: NDArray) -> tuple[float, float | None, float | None]:
    """How strong bands are, how many stand in a picture, and how often one goes by."""
    off = brightness / np.maximum(np.median(brightness, axis=0), 1.0)
    off = off / off.mean(axis=1, keepdims=True) - 1
    off -= off.mean(axis=0)
    place = (np.arange(off.shape[1]) + 0.5) / off.shape[1]
    turns = np.arange(_SLOW, min(_TURNS, off.shape[1] / 4), 0.1)
    per_frame = off @ np.exp(-2j * np.pi * place[:, None] * turns) * 2 / off.shape[1]
    strength = np.sqrt((np.abs(per_frame) ** 2).mean(axis=0))
    best = int(strength.argmax())
    phase = per_frame[:, best]
    waves = np.exp(
        -2j * np.pi * np.concatenate([-_frequencies(times), _frequencies(times)])[:, None] * times
    )
    answer = np.abs(waves @ phase)
    pure = answer.max() > _PURE * np.abs(phase).sum()
    beat = float(np.tile(_frequencies(times), 2)[answer.argmax()]) if pure else None
    return float(100 * strength[best]), round(float(turns[best]), 1) if pure else None, beat


def _lamp(beat: float | None, times: NDArray) -> float | None:
    """The mains whose lamps would beat like this with the camera's frame rate, if it is just one."""
    if beat is None:
        return None
    rate = 1 / np.median(np.diff(times))
    fits = [
        hz
        for hz in MAINS_HZ
        if abs(abs(hz - round(hz / rate) * rate) - beat) < 0.7 / np.ptp(times) + 0.02 * rate
    ]
    return fits[0] if len(fits) == 1 else None


def advice(flicker: Flicker | None) -> list[Advice]:
    if flicker is None or max(flicker["amplitude_pct"], flicker["bands_pct"]) < SEEN_PCT:
        return []
    light = (
        say("flicker.seen", "Light flickers:")
        if flicker["lamp_hz"] is None
        else say(
            "flicker.seen-as-lamps",
            "Light flickers as lamps do at {hz:.0f} Hz:",
            hz=flicker["lamp_hz"],
        )
    )
    periods = [1000 / hz for hz in ([flicker["lamp_hz"]] if flicker["lamp_hz"] else MAINS_HZ)]
    fix = (
        say(
            "flicker.set-exposure",
            "Set the exposure to {ms:.3g} ms or a whole multiple of it, or light the field "
            "with lamps that do not flicker.",
            ms=periods[0],
        )
        if len(periods) == 1
        else say(
            "flicker.set-one-exposure",
            "Set the exposure to {ms:.3g} ms or {other_ms:.3g} ms or a whole multiple "
            "of it, or light the field with lamps that do not flicker.",
            ms=periods[0],
            other_ms=periods[1],
        )
    )
    if flicker["bands_pct"] > flicker["amplitude_pct"]:
        what = (
            say(
                "flicker.some-bands",
                "{bands:.2g} bands of {percent:percent} % move through the picture.",
                bands=flicker["bands"],
                percent=flicker["bands_pct"],
            )
            if (flicker["bands"] or 0) > 1
            else say(
                "flicker.bands",
                "bands of {percent:percent} % move through the picture.",
                percent=flicker["bands_pct"],
            )
        )
        bad = flicker["bands_pct"] >= MUCH_PCT
    else:
        what = (
            say(
                "flicker.varies",
                "the brightness varies by {percent:percent} %.",
                percent=flicker["amplitude_pct"],
            )
            if flicker["beat_hz"] is None
            else say(
                "flicker.beats",
                "the brightness varies by {percent:percent} %, {hz:.1f} times a second in the picture.",
                percent=flicker["amplitude_pct"],
                hz=flicker["beat_hz"],
            )
        )
        bad = flicker["amplitude_pct"] >= MUCH_PCT
    return [message(join(light, what), fix, bad)]
