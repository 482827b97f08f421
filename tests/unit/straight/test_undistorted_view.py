"""The picture without its bend: there and back, what of it is in sight, and sizes that do not fit."""

import numpy as np
import pytest

from tests.support.bar_pictures import SIZE, STRAIGHT, bars_behind
from tests.support.straight_edges import lens_of
from touchline.core.errors import Conflict
from touchline.straight.straightness import UndistortedView, undistort

LENSES = [
    lens_of(name, terms, size=SIZE)
    for name, terms in (
        ("division", (-0.3,)),
        ("division", (0.08,)),
        ("division-even", (-0.6, -0.1)),
        ("brown-conrady", (-0.28, 0.09)),
    )
]


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.name} {lens.terms[0]}")
def test_there_and_back_is_the_same_pixel(lens):
    view = UndistortedView(lens)
    raw = np.stack(np.meshgrid(np.linspace(0, 639, 9), np.linspace(0, 479, 7)), axis=-1)
    assert view.raw_from_corrected(view.corrected_from_raw(raw)) == pytest.approx(raw, abs=1e-6)


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: f"{lens.name} {lens.terms[0]}")
def test_the_middle_of_every_edge_is_still_in_sight_and_one_is_at_the_end(lens):
    middles = np.array([[0, 239.5], [639, 239.5], [319.5, 0], [319.5, 479]])
    drawn = UndistortedView(lens).corrected_from_raw(middles)
    away = np.abs(drawn - (319.5, 239.5)) / (319.5, 239.5)
    assert away.max() == pytest.approx(1)


def test_a_lens_that_ends_inside_the_picture_is_drawn_as_far_as_it_reaches():
    view = UndistortedView(lens_of("division", (-40.0,), size=SIZE))
    assert view.scale == 1
    assert np.isnan(view.corrected_from_raw(np.array([0.0, 0.0]))).all()
    assert undistort(bars_behind(), view.lens).shape == (480, 640, 3)


def test_without_a_bend_the_picture_stays_what_it_is():
    pixels = bars_behind()
    assert np.abs(undistort(pixels, STRAIGHT).astype(int) - pixels).max() <= 1


def test_a_picture_of_another_size_is_refused():
    with pytest.raises(Conflict) as refused:
        undistort(np.zeros((48, 64, 3), np.uint8), STRAIGHT)
    assert refused.value.reason == "size-mismatch"
