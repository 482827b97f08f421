"""Boards in pictures: corners to a few hundredths of a pixel, new and old ChArUco patterns, nothing where none is."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import picture_of
from touchline.boards.board import Board, find_board, refine_corners_by_square

CHESS = Board("chessboard", 9, 6, 30.0)
CHARUCO = Board("charuco", 7, 5, 30.0, 22.0, "DICT_4X4_100")
TILTED = np.array([[1.9, 0.25, 260], [-0.12, 1.75, 240], [2.2e-4, -1.5e-4, 1.0]])


def through(homography, places_mm):
    seen = np.column_stack([places_mm[:, :2], np.ones(len(places_mm))]) @ homography.T
    return seen[:, :2] / seen[:, 2:]


def farthest(view, homography):
    return np.linalg.norm(view.pixels - through(homography, view.places_mm), axis=1).max()


def test_a_chessboards_corners_are_found_to_a_few_hundredths_of_a_pixel():
    view = find_board(picture_of(CHESS, TILTED), CHESS)
    assert len(view.pixels) == 54
    turned = replace_places(view, CHESS)
    # px; a finder may begin at either end
    assert min(farthest(view, TILTED), farthest(turned, TILTED)) < 0.06


def replace_places(view, board):
    """The same corners counted from the other end."""
    return type(view)(view.pixels, board.places_mm[::-1].copy(), view.name)


@pytest.mark.parametrize("legacy", [False, True])
def test_a_charuco_board_is_found_in_its_own_pattern_only(legacy):
    """Boards with an even number of rows of squares differ between old and new; the wrong one must not half match."""
    board = replace(CHARUCO, legacy=legacy)
    picture = picture_of(board, TILTED)
    view = find_board(picture, board)
    assert len(view.pixels) == 35
    # px; markers leave a smaller window than a chessboard's squares
    assert farthest(view, TILTED) < 0.1
    other = find_board(picture, replace(board, legacy=not legacy))
    assert other is None or len(other.pixels) < 6


def test_a_charuco_board_half_outside_gives_the_corners_that_are_in():
    shifted = np.array([[1, 0, -330], [0, 1, 0], [0, 0, 1.0]]) @ TILTED
    view = find_board(picture_of(CHARUCO, shifted), CHARUCO)
    assert 6 <= len(view.pixels) < 35
    assert farthest(view, shifted) < 0.1


def test_a_picture_without_a_board_gives_none():
    noise = np.random.default_rng(0).integers(0, 255, (300, 400, 3), np.uint8)
    assert find_board(noise, CHESS) is None
    assert find_board(noise, CHARUCO) is None
    assert find_board(np.zeros((300, 400), np.uint8), CHESS) is None


def test_a_large_picture_is_looked_at_small_and_refined_at_full_size():
    twice = np.diag([2.6, 2.6, 1.0]) @ TILTED
    view = find_board(picture_of(CHESS, twice, (2600, 2080)), CHESS)
    assert min(farthest(view, twice), farthest(replace_places(view, CHESS), twice)) < 0.06


def test_small_squares_are_refined_in_small_windows():
    """A window as wide as for large squares reaches the next corners and is drawn to them."""
    small = np.diag([0.22, 0.22, 1.0]) @ np.array([[1.5, 0.1, 300], [-0.1, 1.4, 200], [1e-4, 0, 1]])
    picture = picture_of(CHESS, small, (300, 200))
    true = through(small, CHESS.places_mm)
    guess = true + np.random.default_rng(1).uniform(-0.7, 0.7, true.shape)
    steps = CHESS.places_mm[:, :2] / CHESS.square_mm
    ours = np.linalg.norm(refine_corners_by_square(picture, guess, steps) - true, axis=1)
    wide = np.linalg.norm(refine_corners_by_square(picture, guess, steps, reach=1.2) - true, axis=1)
    assert np.sqrt(np.mean(ours**2)) < 0.1
    assert np.sqrt(np.mean(wide**2)) > 2 * np.sqrt(np.mean(ours**2))
