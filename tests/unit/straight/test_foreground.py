"""What moves in front of a still camera, and what is only the light."""

import numpy as np
import pytest

from touchline.straight.tracks import MotionDetector


@pytest.mark.parametrize(
    "colour", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], ids=["blue", "green", "red", "white"]
)
def test_a_ball_is_seen_after_light_of_any_colour_has_changed_slowly(colour):
    detector, frame = MotionDetector(), np.full((120, 160, 3), 90, np.uint8)
    for _ in range(60):
        frame = frame + np.array(colour, np.uint8)
        assert not detector.add(frame)
    frame[40:48, 100:108] -= 40
    (ball,) = detector.add(frame)
    assert (ball.x, ball.y) == pytest.approx((103.5, 43.5), abs=0.2) and detector.upset == 0
