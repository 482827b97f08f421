"""What a calibrated picture shows of a field that the field does not have: its bright lines, in millimetres."""

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core import opencv
from touchline.core.errors import Conflict
from touchline.core.field import Field, FieldJson
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Calibration
from touchline.core.sentences import DETECTING_LINES
from touchline.core.statements import say
from touchline.fitting.seen_markings import with_seen
from touchline.models import field_from_raw, model_of
from touchline.vision.ridges import painted_lines


class SeenField(TypedDict):
    """The field with what was added, and the names of that."""

    field: FieldJson
    added: list[str]


def seen_field(pixels: NDArray[np.uint8], calibration: Calibration, field: Field,
               progress: Progress = no_progress) -> SeenField:
    """Add the lines and circles that the picture shows; Conflict for a picture of another size.

    The calibration says where the carpet is; it may be one of another field in the same place, such as the borders
    alone.
    """
    if (pixels.shape[1], pixels.shape[0]) != tuple(calibration.image_size):
        raise Conflict(say("image.other-size-in-pixels", "The image is {width} × {height}; the calibration is for "
                           "{wanted}.", width=pixels.shape[1], height=pixels.shape[0], wanted=calibration.image_size),
                       say("image.take-that-size", "Take an image of that size."), reason="size-mismatch")
    progress(0.0, DETECTING_LINES)
    model, chains = model_of(calibration), painted_lines(opencv.to_grey(pixels)).chains
    progress(0.7, say("progress.measuring-lines", "Measuring lines"))
    on_carpet = [field_from_raw(model, chain) for chain in chains]
    found, names = with_seen(field, [places for places in on_carpet if np.isfinite(places).all()])
    return {"field": found.to_json(), "added": list(names)}
