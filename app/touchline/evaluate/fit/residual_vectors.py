"""Residuals as vectors: from where each point was clicked to where the model puts it, in pixels of either picture.

A vector ends at the nearest place of the point's line or arc, or at its landmark, as the model sees it.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.field import Field, Region
from touchline.core.geometry import Points
from touchline.core.json_values import PointJson
from touchline.core.records import Observations
from touchline.evaluate.fit.report_types import ResidualRow
from touchline.evaluate.fit.residuals import feature_residuals, mm_per_px, residual_rows
from touchline.models import CameraModel


class Arrow(ResidualRow):
    feature: str | PointJson
    index: int


class ResidualVectors(TypedDict):
    """mm_per_px: what a pixel is worth at the points, median."""

    mm_per_px: float | None
    arrows: list[Arrow]


def residual_vectors(model: CameraModel, observations: Observations, field: Field, region: Region,
                     strays: Sequence[NDArray[np.bool_]], seen: Callable[[Points], Points]) -> ResidualVectors:
    """Return every point's arrow, None where the model does not reach.

    strays: for each observation, which of its points (n,) the fit left out. seen: raw pixels (n, 2) to those of the
    picture that is drawn on. px: an arrow's length there. mm_vector: the same in field mm.
    """
    arrows: list[Arrow] = []
    px, mm = [], []
    for observation, out in zip(observations, strays, strict=True):
        residuals = feature_residuals(model, observation, field, region)
        start, end = seen(observation.points), seen(residuals.foot)
        length = np.linalg.norm(end - start, axis=-1)
        px.append(length[~out])
        mm.append(residuals.mm[~out])
        arrows += [{"feature": observation.feature_json, "index": index, **row}
                   for index, row in enumerate(residual_rows(residuals, start, end, length, out))]
    return {"mm_per_px": mm_per_px(*(np.concatenate([np.empty(0), *parts]) for parts in (px, mm))), "arrows": arrows}
