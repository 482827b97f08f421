"""The inner corners of a chessboard or ChArUco board in a picture, to sub-pixel.

A chessboard is found whole or not at all; of a ChArUco board those corners count whose markers could be read, so it
may reach beyond the picture's edge, where lenses need corners most.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.board import Board, BoardView
from touchline.core.geometry import Points
from touchline.core.opencv import find_charuco, find_chessboard, fit_within, to_grey
from touchline.vision.board.corners import REACH, refine_corners_by_square

FINDING_PX = 1600  # the longer side of the picture that corners are first looked for in; full size then refines them
THOROUGH_PX = 1000  # the slow finder's, which takes seconds on more
QUICK_PX = 800  # the longer side of what the quick search looks at: 20 to 40 ms
MARKER_MARGIN = 0.9  # of the white rim around a marker: its black edge would draw the corner away


def find_board(pixels: NDArray[np.uint8], board: Board, name: str = "") -> BoardView | None:
    """Find the board; None where the picture shows none."""
    gray = _gray(pixels)
    if board.kind == "charuco":
        return _charuco(gray, board, name)
    corners = _chessboard(gray, board)
    if corners is None:
        return None
    places = board.places_mm
    return BoardView(refine_corners_by_square(gray, corners, places[:, :2] / board.square_mm), places, name)


def find_board_quickly(pixels: NDArray[np.uint8], board: Board) -> BoardView | None:
    """Find the board in a reduced picture, to about half a pixel of its own; None where there is none.

    For live guidance while a board is held up; what a lens is fitted to is found again, exactly, in the stored picture.
    """
    height, width = pixels.shape[:2]
    scale = min(1.0, QUICK_PX / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = pixels if scale == 1.0 else np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)
    gray = to_grey(small)
    corners, places = (_charuco_corners(gray, board) if board.kind == "charuco" else
                       (find_chessboard(gray, board.columns, board.rows, thorough=False), board.places_mm))
    if corners is None or not len(corners):
        return None
    return BoardView((corners + 0.5) * np.array([width / size[0], height / size[1]]) - 0.5, places)


def _chessboard(gray: NDArray[np.uint8], board: Board) -> Points | None:
    """The quick finder, and where it fails the thorough one."""
    for longest, thorough in ((FINDING_PX, False), (THOROUGH_PX, True)):
        small, scale = fit_within(gray, longest)
        corners = find_chessboard(small, board.columns, board.rows, thorough=thorough)
        if corners is not None:
            return (corners + 0.5) / scale - 0.5
    return None


def _charuco(gray: NDArray[np.uint8], board: Board, name: str) -> BoardView | None:
    corners, places = _charuco_corners(gray, board)
    if not len(corners):
        return None
    rim = (board.square_mm - board.marker_mm) / 2 / board.square_mm
    fine = refine_corners_by_square(gray, corners, places[:, :2] / board.square_mm, min(REACH, MARKER_MARGIN * rim))
    return BoardView(fine, places, name)


def _charuco_corners(gray: NDArray[np.uint8], board: Board) -> tuple[Points, NDArray[np.float64]]:
    """Corners (n, 2) px that were found, and their places (n, 3) mm."""
    corners, numbers = find_charuco(gray, board.columns, board.rows, board.square_mm, board.marker_mm,
                                    board.dictionary, board.legacy)
    return corners, board.places_mm[numbers]


def _gray(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Luminance; blue, green, red in."""
    if pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    weights = np.array([0.114, 0.587, 0.299], np.float32)
    return np.rint(pixels[..., :3].astype(np.float32) @ weights).astype(np.uint8)
