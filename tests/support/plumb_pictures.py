"""Pictures of straight edges that other people published, where they are at hand; and how straight they are."""

import cv2
import pytest

from tests.support.paths import SHARED_DATA
from touchline.core.geometry import ImageSize
from touchline.straight.straightness import straightness
from touchline.vision.edges import edge_chains

LINES = SHARED_DATA / "lines"


def picture(name):
    """BGR pixels of lines/NAME; skips the test, by name, where it is absent."""
    path = LINES / name
    if not path.exists():
        pytest.skip(f"no {name} beside the project, under shared/data/lines")
    return cv2.imread(str(path))


def department():
    """The eight pictures of one wide-angle camera; skips where they are absent."""
    names = sorted(p.name for p in (LINES / "department_dataset").glob("*.bmp"))
    if len(names) < 8:
        pytest.skip("no department_dataset beside the project, under shared/data/lines")
    return [picture(f"department_dataset/{name}") for name in names]


def straightness_of(pixels):
    """The report on the edges of one picture (h, w, 3)."""
    return straightness([edge_chains(pixels)], (), ImageSize(pixels.shape[1], pixels.shape[0]))
