"""A film of a board that is held before a camera, each pose for a while: for whoever watches for it live."""

from pathlib import Path

import cv2
import numpy as np

from tests.support.board_views import picture_of
from touchline.boards.board import Board
from touchline.boards.poses import BoardPose, pose_history
from touchline.core.geometry import ImageSize

BOARD = Board("chessboard", 9, 6, 30.0)
SIZE = ImageSize(640, 480)
FPS = 10


def poses(count: int) -> list[np.ndarray]:
    """Quads of somebody who does what he is told: all different."""
    shown: list[BoardPose] = []
    while len(shown) < count:
        wanted = pose_history(shown, BOARD, SIZE).next_view
        assert wanted is not None
        shown.append(BoardPose.from_points(wanted["outline"], SIZE))
    return [pose.quad for pose in shown]


def film(path: Path, count: int, hold_s: float = 1.5) -> Path:
    """An AVI (Motion JPEG); between two poses the hand moves for half a second."""
    corners = BOARD.places_mm[[0, 8, 53, 45], :2].astype(np.float32)
    out = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), FPS, tuple(SIZE))
    assert out.isOpened()
    quads = poses(count)
    for before, quad in zip([quads[-1], *quads], quads, strict=False):
        for step in range(round(FPS / 2)):
            share = step * 2 / FPS
            out.write(_frame(corners, before * (1 - share) + quad * share))
        still = _frame(corners, quad)
        for _ in range(round(FPS * hold_s)):
            out.write(still)
    out.release()
    return path


def _frame(corners: np.ndarray, quad: np.ndarray) -> np.ndarray:
    grey = picture_of(
        BOARD,
        cv2.getPerspectiveTransform(corners, quad.astype(np.float32)),
        (SIZE.width, SIZE.height),
    )
    return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
