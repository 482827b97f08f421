"""How far lines lie beside their places is learned from the picture, and tilts do not speak for it."""

import numpy as np
import pytest

from app.fitting.ray_camera.line_offsets import line_sigmas_mm

USUAL_MM = 3.0


def learned(offsets_mm, kind):
    """Return σ of offsets that the clicks tell to 0.1 mm each."""
    prior_mm = np.full(len(offsets_mm), USUAL_MM)
    jacobian = np.concatenate([np.diag(np.full(len(offsets_mm), 10.0)), np.diag(1 / prior_mm)])
    return line_sigmas_mm(jacobian, range(len(offsets_mm)), offsets_mm, prior_mm, USUAL_MM, np.array(kind))


def test_straight_lines_may_lie_beside_their_places():
    offsets, tilts = np.array([3.0, -4.0, 2.5, -3.5, 4.5, -2.0]), np.array([0.1, -0.1, 0.1, 0.0, 0.1, -0.1])
    both = np.concatenate([offsets, tilts])
    sigmas = learned(both, [0] * 6 + [1] * 6)
    alone = learned(offsets, [0] * 6)
    assert np.median(sigmas[:6]) == pytest.approx(np.median(alone), rel=0.1)
    assert np.median(sigmas[6:]) < 0.5 < 2.0 < np.median(sigmas[:6])
    assert np.median(learned(both, [0] * 12)[:6]) < 0.8 * np.median(alone)  # one σ for both would be too small


def test_one_line_far_off_does_not_speak_for_the_others():
    sigmas = learned(np.array([0.3, -0.2, 0.4, -0.3, 0.1, 12.0]), [0] * 6)
    assert sigmas[5] > 2 * sigmas[0] and sigmas[0] < USUAL_MM
