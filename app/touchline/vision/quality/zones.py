"""The nine zones of a picture, three by three, and what they are called."""

from collections.abc import Iterable
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.statements import Sentence, Stated, capitalised, say, stated

ZONES = (say("zone.top-left", "top left"), say("zone.top", "top"), say("zone.top-right", "top right"),
         say("zone.left", "left"), say("zone.middle", "middle"), say("zone.right", "right"),
         say("zone.bottom-left", "bottom left"), say("zone.bottom", "bottom"), say("zone.bottom-right", "bottom right"))
WHOLE = say("zone.whole-image", "whole image")
MIDDLE = 4
_GROUPS = {say("zone.rim", "rim"): (0, 1, 2, 3, 5, 6, 7, 8), say("zone.corners", "corners"): (0, 2, 6, 8),
           say("zone.left-edge", "left edge"): (0, 3, 6), say("zone.right-edge", "right edge"): (2, 5, 8),
           say("zone.top-edge", "top edge"): (0, 1, 2), say("zone.bottom-edge", "bottom edge"): (6, 7, 8)}


def zone_slices(height: int, width: int) -> list[tuple[slice, slice]]:
    """Rows and columns of each zone, in the order of ZONES."""
    rows, columns = (np.linspace(0, n, 4).round().astype(int) for n in (height, width))
    return [(slice(rows[i], rows[i + 1]), slice(columns[j], columns[j + 1])) for i in range(3) for j in range(3)]


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
    if field.ndim == 2 and field.shape[1] == 2 and len(field) >= 3 and field.dtype != np.bool_ \
            and (np.abs(field) < 1e6).all():  # NaN is not below it
        mask = np.zeros((height, width), np.uint8)
        cv2.fillPoly(mask, [np.rint(field).astype(np.int32)], 1)
        return mask > 0
    raise BadInput("The outline of the field does not match the image.",
                   "Use a mask of the image size, or a polygon of at least three corners in pixels.",
                   reason="bad-outline")
