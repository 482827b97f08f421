"""Where one camera of a pair has what the other sees."""

from dataclasses import replace

import numpy as np

from tests.support.exported import model_of, of_model
from touchline.core.geometry import ImageSize
from touchline.workflows.pair import lines_by_calibrations


def test_a_place_is_told_wherever_the_other_picture_shows_it_though_that_is_larger():
    large, size = model_of("brown-conrady", 0), ImageSize(640, 512)
    small = replace(large, image_size=size, focal_px=large.focal_px / 2, centre_px=size.centre)
    in_large = np.array([[1000.0, 800.0], [300.0, 200.0]])
    in_small = (in_large + 0.5) / 2 - 0.5
    found = lines_by_calibrations(of_model(large), of_model(small), in_large, in_small)
    np.testing.assert_allclose(np.array(found["place_in_a"], float), in_large, atol=1e-6)
    np.testing.assert_allclose(np.array(found["place_in_b"], float), in_small, atol=1e-6)
