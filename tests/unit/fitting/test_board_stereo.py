"""Two cameras and one board: their pose is exact on exact corners, and pairs that do not fit are refused."""

import numpy as np
import pytest

from app.core.board import BoardView
from app.core.errors import TouchlineError
from app.fitting.board.initial import poses_from_rays
from app.fitting.board.parameters import Sights, matrices_from_vectors
from app.fitting.board.stereo import epipolar_error, stereo_pose
from app.models.rotation import matrix_from_vector
from tests.support.board_views import BOARD, TRUTH, bowed, views_of

TURN, SHIFT = np.array([0.02, -0.15, 0.01]), np.array([-320.0, 8.0, 15.0])


def pairs(count=8, noise_px=0.0):
    """What a second camera of the same lens sees of the same (flat) boards."""
    rng, left, right = np.random.default_rng(0), [], []
    for view in views_of(count=count, noise_px=0, bow_mm=(0, 0)):
        sights = Sights.of((view,))
        (rotation,), (shift,) = poses_from_rays(TRUTH.rays(sights.pixels), sights)
        seen = (BOARD.places_mm @ rotation.T + shift) @ matrix_from_vector(TURN).T + SHIFT
        pixels = TRUTH.project(seen)
        fine = np.isfinite(pixels).all(axis=1)
        left.append(BoardView(view.pixels + rng.normal(0, 1, view.pixels.shape) * noise_px, view.places_mm, view.name))
        right.append(BoardView(pixels[fine] + rng.normal(0, 1, (fine.sum(), 2)) * noise_px, view.places_mm[fine], ""))
    return tuple(left), tuple(right)


def test_exact_pairs_give_the_exact_pose():
    pose = stereo_pose(TRUTH, TRUTH, *pairs())
    np.testing.assert_allclose(pose.rotation, TURN, atol=1e-8)
    np.testing.assert_allclose(pose.shift_mm, SHIFT, atol=1e-4)
    assert pose.epipolar_px < 1e-5


def test_noisy_pairs_are_within_their_sigma_and_strays_left_out():
    left, right = pairs(12, 0.2)
    spoilt = right[0].pixels.copy()
    spoilt[3] += 30
    right = (BoardView(spoilt, right[0].places_mm), *right[1:])
    pose = stereo_pose(TRUTH, TRUTH, left, right)
    turned = matrices_from_vectors(np.array(pose.rotation)[None])[0] @ matrix_from_vector(TURN).T
    error = np.concatenate([[turned[2, 1], turned[0, 2], turned[1, 0]], np.array(pose.shift_mm) - SHIFT])
    assert (np.abs(error) < 4 * np.sqrt(np.diag(pose.covariance))).all()
    assert pose.strays == 1 and pose.sigma_px == pytest.approx(0.2, abs=0.02)
    assert 0.1 < pose.epipolar_px < 0.3


def test_the_epipolar_error_is_a_distance_in_pixels():
    left, right = pairs(3)
    pixels = (left[0].pixels[:len(right[0].pixels)], right[0].pixels)
    turn = matrix_from_vector(TURN)
    assert epipolar_error((TRUTH, TRUTH), turn, SHIFT, pixels) < 1e-5
    off = (pixels[0], pixels[1] + [0, 1.0])  # the baseline lies along x, so one pixel in y is one off the line
    assert epipolar_error((TRUTH, TRUTH), turn, SHIFT, off) == pytest.approx(1.0, abs=0.35)


def test_the_boards_bow_is_told():
    left, right = pairs(6)
    assert np.abs(bowed(BOARD, (1.0, 0))[:, 2]).max() > 0.9
    assert stereo_pose(TRUTH, TRUTH, left, right, (20.0, 0.0)).sigma_px > 0.05


@pytest.mark.parametrize("change", [lambda a, b: (a, b[:-1]), lambda a, b: ((), ()),
                                    lambda a, b: (a, tuple(v.only(np.arange(len(v.pixels)) < 3) for v in b))])
def test_what_is_no_pair_is_refused(change):
    with pytest.raises(TouchlineError):
        stereo_pose(TRUTH, TRUTH, *change(*pairs(3)))
