"""Lines are measured where they are expected, as wide as they are painted."""

import cv2
import numpy as np
import pytest

from touchline.vision.profiles import across_lines, strays

CAPTURE_PX = 4.0


def picture_of(middle: float, width: float, noise: float = 1.0) -> np.ndarray:
    x = np.arange(160 * 16) / 16
    bar = (
        ((np.abs(x - middle - 0.5 + 0.5 / 16) <= width / 2) * 140.0 + 60.0)
        .reshape(160, 16)
        .mean(axis=1)
    )
    grey = cv2.GaussianBlur(np.tile(bar, (80, 1)), (0, 0), 0.8)
    return np.clip(grey + np.random.default_rng(0).normal(0, noise, grey.shape), 0, 255).astype(
        np.uint8
    )


@pytest.mark.parametrize("width", [2.0, 3.4, 7.0, 12.3])
@pytest.mark.parametrize("beside", [0.0, 2.6, -3.4])
def test_a_line_of_any_width_is_found_by_its_middle(width, beside):
    places = np.column_stack([np.full(20, 80.4 - beside), np.linspace(10, 70, 20)])
    found = across_lines(
        picture_of(80.4, width),
        places,
        np.tile([1.0, 0.0], (20, 1)),
        np.full(20, 3.4),
        np.zeros(20, int),
        CAPTURE_PX,
    )
    assert found.found.all()
    assert found.middle == pytest.approx(beside, abs=0.15)
    assert found.widths[0] * 3.4 == pytest.approx(width, rel=0.25)


@pytest.mark.parametrize("stray", [0, 7, 12])
def test_a_point_off_its_lines_course_is_a_stray_wherever_it_lies(stray):
    along = np.linspace(-1, 1, 13)
    course = 2.0 + 0.9 * along - 0.7 * along**2 + np.random.default_rng(1).normal(0, 0.05, 13)
    course[stray] += 1.1
    middle = np.concatenate([course, np.random.default_rng(2).normal(-1.5, 0.05, 9)])
    line = np.repeat([0, 1], [13, 9])
    assert np.flatnonzero(strays(middle, np.ones(22, bool), line)).tolist() == [stray]


def test_points_that_were_not_found_are_no_strays():
    assert not strays(
        np.array([0.1, np.nan, 0.2]), np.array([True, False, True]), np.zeros(3, int)
    ).any()
    assert not strays(np.array([np.nan]), np.array([False]), np.zeros(1, int)).any()
