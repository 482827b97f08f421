"""The nine zones of a picture, what they are called, and for how long each has stayed the same bit by bit.

What stays the same bit by bit is no picture of a sensor: its noise changes each part of a picture from frame to frame.
What comes as whole pictures, raw or as JPEG, shows that; what is coded from frame to frame (H.264) leaves it out, often
up to the next key frame. Black and white are clipped, and have no noise: they are not counted.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core import opencv
from touchline.core.errors import BadInput
from touchline.core.statements import Sentence, Stated, capitalised, say, stated

ZONES = (
    say("zone.top-left", "top left"),
    say("zone.top", "top"),
    say("zone.top-right", "top right"),
    say("zone.left", "left"),
    say("zone.middle", "middle"),
    say("zone.right", "right"),
    say("zone.bottom-left", "bottom left"),
    say("zone.bottom", "bottom"),
    say("zone.bottom-right", "bottom right"),
)
WHOLE = say("zone.whole-image", "whole image")
MIDDLE = 4
_GROUPS = {
    say("zone.rim", "rim"): (0, 1, 2, 3, 5, 6, 7, 8),
    say("zone.corners", "corners"): (0, 2, 6, 8),
    say("zone.left-edge", "left edge"): (0, 3, 6),
    say("zone.right-edge", "right edge"): (2, 5, 8),
    say("zone.top-edge", "top edge"): (0, 1, 2),
    say("zone.bottom-edge", "bottom edge"): (6, 7, 8),
}

COLUMNS, ROWS = 16, 12
DARKEST, BRIGHTEST = 16, 240  # grey levels, on average: what is counted
MIN_CELLS = 24  # that must be counted
LARGE = 0.9  # of the cells: all but a clock, a caption or a cursor
LIVELY_S, ENOUGH_S = 5.0, 20.0  # LARGE changes within LIVELY_S, for ENOUGH_S together: it has noise
LONG_S = 20.0  # longer than from key frame to key frame


def zone_slices(height: int, width: int) -> list[tuple[slice, slice]]:
    """Rows and columns of each zone, in the order of ZONES."""
    rows, columns = (np.linspace(0, n, 4).round().astype(int) for n in (height, width))
    return [
        (slice(rows[i], rows[i + 1]), slice(columns[j], columns[j + 1]))
        for i in range(3)
        for j in range(3)
    ]


def zone_names(zones: Iterable[int], known: Iterable[int] = range(9)) -> list[Sentence]:
    """Name a set of zones: edge, corners or rim where all its known zones are meant; else one by one."""
    meant, known, names = set(zones), set(known), []
    if meant and meant == known:
        return [WHOLE]
    unsaid = set(meant)
    for name, members in _GROUPS.items():
        present = set(members) & known
        if len(present) > 1 and present <= meant and len(present & unsaid) > len(present) / 2:
            names.append(name)
            unsaid -= present
    return names + [ZONES[i] for i in sorted(unsaid)]


def first_capital(names: list[Sentence]) -> list[Sentence]:
    """Return names as they begin a sentence."""
    return [capitalised(names[0]), *names[1:]]


class Advice(Stated):
    """What should be done about a picture."""

    text: str
    fix: str
    severity: Literal["warning", "note"]


def message(text: str, fix: str, bad: bool) -> Advice:
    return stated(Advice(text=text, fix=fix, severity="warning" if bad else "note"))


def field_mask(field: NDArray | None, height: int, width: int) -> NDArray[np.bool_] | None:
    """A field given as a mask (height, width) or a polygon (n, 2) px, as a mask; None stays None."""
    if field is None:
        return None
    field = np.asarray(field)
    if field.dtype == np.bool_ and field.shape == (height, width):
        return field
    if (
        field.ndim == 2
        and field.shape[1] == 2
        and len(field) >= 3
        and field.dtype != np.bool_
        and (np.abs(field) < 1e6).all()
    ):  # NaN is not below it
        mask = np.zeros((height, width), np.uint8)
        cv2.fillPoly(mask, [np.rint(field).astype(np.int32)], 1)
        return mask > 0
    raise BadInput(
        "The outline of the field does not match the image.",
        "Use a mask of the image size, or a polygon of at least three corners in pixels.",
        reason="bad-outline",
    )


class Still(TypedDict):
    """all_s, most_s: for how long all of it, and LARGE of what is counted, has been the same; None where that is dark
    or white. share: of what is counted that has been the same for LONG_S. had_noise: whether noise was ever seen."""

    all_s: float
    most_s: float | None
    share: float
    had_noise: bool


@dataclass
class Stillness:
    """Of pictures one after the other, all of one size; another size begins anew."""

    _before: NDArray[np.uint8] | None = None
    _since: NDArray[np.float64] = field(default_factory=lambda: np.zeros((ROWS, COLUMNS)))
    _moment: float = 0.0
    _lively_s: float = 0.0

    def add(self, picture: NDArray[np.uint8], moment: float) -> Still:
        """picture (h, w[, 3]), moment: s, on any clock that is steady."""
        before, self._before = self._before, picture
        if before is None or before.shape != picture.shape:
            self._since[:], self._moment, self._lively_s = moment, moment, 0.0
        else:
            self._since[_changed(before, picture)] = moment
        passed_s, self._moment = moment - self._moment, moment
        still_s = moment - self._since
        levels = cv2.resize(opencv.to_grey(picture), (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
        counted = still_s[(levels > DARKEST) & (levels < BRIGHTEST)]
        if counted.size < MIN_CELLS:
            return Still(all_s=float(still_s.min()), most_s=None, share=0.0, had_noise=False)
        if np.quantile(counted, LARGE) < LIVELY_S:
            self._lively_s += min(passed_s, LIVELY_S)
        return Still(
            all_s=float(still_s.min()),
            most_s=float(np.quantile(counted, 1 - LARGE)),
            share=float(np.mean(counted >= LONG_S)),
            had_noise=self._lively_s >= ENOUGH_S,
        )


def _changed(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which cells (ROWS, COLUMNS) differ in any pixel."""
    differs = (one != other).reshape(*one.shape[:2], -1).any(axis=2)
    rows, columns = (
        np.arange(count) * length // count
        for count, length in zip((ROWS, COLUMNS), differs.shape, strict=True)
    )
    return np.logical_or.reduceat(np.logical_or.reduceat(differs, rows, axis=0), columns, axis=1)
