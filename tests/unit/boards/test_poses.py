"""A board before a camera whose lens is not known: how it is held, when it is still and new, what is wanted next."""

import numpy as np
import pytest

from tests.support.board_views import picture_of
from touchline.boards.board import Board, BoardView, find_board_quickly
from touchline.boards.poses import MIN_VIEWS, STILL_S, BoardCapture, BoardPose, pose_history
from touchline.boards.uncertainty import EDGES
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize

BOARD = Board("chessboard", 9, 6, 30.0)
SIZE = ImageSize(640, 480)


def pose(text: str) -> BoardPose:
    """The pose that the suggestion with that sentence draws."""
    return BoardPose.from_points(
        next(w["outline"] for w in suggestions() if text in w["text"]), SIZE
    )


def suggestions():
    """What is wanted one after the other by somebody who always does as he is told."""
    poses = []
    while (wanted := pose_history(poses, BOARD, SIZE).next_view) is not None:
        yield wanted
        poses.append(BoardPose.from_points(wanted["outline"], SIZE))
        assert len(poses) < 60, "there is no end to what is wanted"


def test_who_does_as_he_is_told_has_enough_in_the_end_and_no_view_twice():
    told = list(suggestions())
    poses = [BoardPose.from_points(w["outline"], SIZE) for w in told]
    done = pose_history(poses, BOARD, SIZE)
    assert MIN_VIEWS <= len(told) <= 30
    assert (done.cells > 0).mean() > 0.7 and min(done.tilts.values()) >= 2
    assert not any(a.is_similar(b) for i, a in enumerate(poses) for b in poses[:i])


@pytest.mark.parametrize("nearer", EDGES)
def test_the_edge_that_is_drawn_nearer_is_seen_nearer(nearer):
    for wanted in suggestions():
        if wanted["nearer"] == nearer:
            assert BoardPose.from_points(wanted["outline"], SIZE).nearer == nearer
            assert f"its {nearer} edge nearer" in wanted["text"]


def test_turning_the_board_upside_down_is_no_new_view():
    quad = pose("facing the camera").quad
    turned, before = (
        BoardPose.from_points(np.roll(quad, 2, axis=0), SIZE),
        BoardPose.from_points(quad, SIZE),
    )
    assert turned.is_similar(before) and turned.moved_px(before) == 0


def test_a_part_of_a_board_tells_where_the_rest_is():
    whole = pose("facing the camera")
    corners = whole.corners(BOARD)
    part = BoardPose.of(BoardView(corners[18:33], BOARD.places_mm[18:33]), BOARD, SIZE)
    np.testing.assert_allclose(part.quad, whole.quad, atol=0.01)
    assert BoardPose.of(BoardView(corners[:5], BOARD.places_mm[:5]), BOARD, SIZE) is None
    # all on one line
    assert BoardPose.of(BoardView(corners[:9], BOARD.places_mm[:9]), BOARD, SIZE) is None


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0]] * 4,
        [[0, 0], [1, 1], [2, 2], [3, 3]],
        [[0, 0], [9, 9], [9, 0], [0, 9]],
        [[0, 0], [9, 0], [9, 9]],
        [[0, 0], [1e9, 0], [1e9, 1e9], [0, 1e9]],
    ],
)
def test_what_is_no_quad_is_refused(points):
    with pytest.raises(BadInput):
        BoardPose.from_points(points, SIZE)


def test_a_glimpse_finds_the_board_in_the_pictures_own_pixels():
    # three times as large, pixel centres
    size, quad = ImageSize(1920, 1440), pose("facing the camera").quad * 3 + 1
    import cv2

    corners = BOARD.places_mm[[0, 8, 53, 45], :2].astype(np.float32)
    picture = picture_of(
        BOARD, cv2.getPerspectiveTransform(corners, quad.astype(np.float32)), tuple(size)
    )
    found = find_board_quickly(picture, BOARD)
    assert BoardPose.of(found, BOARD, size).moved_px(BoardPose(quad, size)) < 1.0
    assert find_board_quickly(np.full((480, 640, 3), 128, np.uint8), BOARD) is None


def test_a_view_is_taken_when_it_is_still_and_new_and_not_before():
    watched, one = BoardCapture(BOARD, SIZE), pose("facing the camera").quad
    assert watched.update(None, 0.0)["hint"].startswith("No board")
    assert watched.update(one, 0.1) == {
        "still": False,
        "new": True,
        "hint": "Hold the board still.",
    }
    assert not watched.update(one + 30, STILL_S)["still"]  # it has moved
    assert not watched.update(one + 30, STILL_S + 0.2)["still"]
    assert watched.update(one + 30.5, 2 * STILL_S) == {"still": True, "new": True, "hint": ""}
    watched.add_view(one + 30)
    again = watched.update(one + 31, 3 * STILL_S)
    assert not again["new"] and "already" in again["hint"]
    assert watched.coverage.cells.sum() == 54


def test_a_hand_that_drifts_slowly_is_not_still():
    watched, one = BoardCapture(BOARD, SIZE), pose("facing the camera").quad
    looks = [watched.update(one + 3.0 * step, 0.2 * step) for step in range(10)]
    assert not any(look["still"] for look in looks)
