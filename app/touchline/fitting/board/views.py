"""Views that cannot be used: too few corners, corners on one line, outside the picture, or a board that is not flat."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchline.core.board import BoardView
from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, inside_picture
from touchline.core.text_format import sentence

MIN_CORNERS = 6  # a pose takes six of twelve numbers; with four corners, one wrong corner would go unseen
THIN = 0.02  # corners narrower than this share of their length are on one line
SAME_PX = 1e-3  # two pictures never agree so well; a picture given twice would seem to make the lens surer
MAX_BOW = 0.05  # of the board's half diagonal; a bow beyond it is no board


@dataclass(frozen=True)
class RejectedView:
    """A view that is not used. index: among all views, from 0."""

    index: int
    name: str
    reason: str  # kebab-case, for scripts
    text: str  # one sentence

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", sentence(self.text))

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))


def unusable_views(views: tuple[BoardView, ...], image_size: ImageSize) -> Iterator[RejectedView]:
    """Yield the views that are rejected before anything is computed, each with its reason."""
    first: dict[bytes, str] = {}
    for index, view in enumerate(views):
        name = view.name or f"view {index + 1}"
        n = len(view.pixels)
        if n < MIN_CORNERS:
            yield RejectedView(index, name, "too-few-corners",
                               f"{name} has {n} corners; at least {MIN_CORNERS} are required.")
        elif _collinear(view.pixels) or _collinear(view.places_mm[:, :2]):
            yield RejectedView(index, name, "corners-on-a-line",
                               f"The corners of {name} are on one line and do not determine a pose.")
        elif not inside_picture(view.pixels, image_size, -1).all():
            yield RejectedView(index, name, "outside-picture",
                               f"{name} has corners outside the image of {image_size}.")
        elif (same := np.rint(view.pixels / SAME_PX).tobytes()) in first:
            yield RejectedView(index, name, "seen-already", f"{name} repeats {first[same]} and adds no information.")
        else:
            first[same] = name


def refuse_bent_board(views: tuple[BoardView, ...]) -> None:
    """Raise FitFailed where the corners' places are not those of one flat board."""
    places = np.concatenate([view.places_mm for view in views]) if views else np.zeros((0, 3))
    if len(places) and np.ptp(places[:, 2]) > MAX_BOW * max(np.ptp(places[:, 0]), np.ptp(places[:, 1])):
        raise FitFailed("The object points are not in one plane.", "Use a flat board, with z = 0 on its face.",
                        reason="board-not-flat")


def _collinear(points: Array) -> bool:
    across = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return not across[1] > THIN * across[0]
