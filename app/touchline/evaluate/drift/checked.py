"""A calibration held against a picture: its lines, the figures and the verdict."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import ImageSize, Pixels
from touchline.core.records import Calibration
from touchline.evaluate.drift.change import change_since
from touchline.evaluate.drift.check_figures import CheckFigures, check_figures
from touchline.evaluate.drift.check_verdict import CheckVerdict, check_verdict
from touchline.evaluate.drift.line_check import (
    LineDeviation,
    LineMeasurements,
    line_deviations,
    measure_change,
    measure_lines,
)
from touchline.evaluate.drift.promise import Promise, believed_observations
from touchline.models import Restored
from touchline.vision.ridges import with_bright_lines


class Checked(NamedTuple):
    """seen: where the model's lines are."""

    seen: LineMeasurements
    lines: list[LineDeviation]
    figures: CheckFigures
    verdict: CheckVerdict


def checked(calibration: Calibration, gray: Pixels, others: Callable[[LineMeasurements], float] | None = None,
            ) -> Checked:
    """gray: (h, w) of the calibration's size. others: tells the length of other long lines, as a share of these."""
    model, field, region = Restored.of(calibration)
    size = ImageSize(gray.shape[1], gray.shape[0])
    seen = measure_lines(model, gray, field, region)
    since = measure_change(model, gray, field, region, believed_observations(calibration))
    found = check_figures(seen, model, size, field, Promise.of(calibration.report),
                          change_since(since, model, size, field), others(seen) if others is not None else 0.0)
    lines = line_deviations(seen)
    return Checked(seen, lines, found, check_verdict(found, lines))


def verdict_in(picture: NDArray[np.uint8], calibration: Calibration) -> CheckVerdict:
    """Return the verdict of a check in a picture (h, w[, 3]) of the calibration's size."""
    return checked(calibration, with_bright_lines(picture)).verdict
