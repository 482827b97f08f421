"""A quick search for a board in a reduced picture, to about half a pixel.

For live guidance while a board is held up; what a lens is fitted to is found again, exactly, in the stored picture.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.board import Board, BoardView
from app.core.opencv import find_charuco, find_chessboard

SEARCH_PX = 800  # the longer side of what is looked at: 20 to 40 ms


def find_board_quickly(pixels: NDArray[np.uint8], board: Board) -> BoardView | None:
    """Find the board, in the picture's own pixels, to about half a pixel; None where there is none."""
    height, width = pixels.shape[:2]
    scale = min(1.0, SEARCH_PX / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = pixels if scale == 1.0 else cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    gray = small if small.ndim == 2 else cv2.cvtColor(small, cv2.COLOR_BGR2GRAY)
    if board.kind == "charuco":
        corners, numbers = find_charuco(gray, board.columns, board.rows, board.square_mm, board.marker_mm,
                                        board.dictionary, board.legacy)
        places = board.places_mm[numbers]
    else:
        corners, places = find_chessboard(gray, board.columns, board.rows, thorough=False), board.places_mm
    if corners is None or not len(corners):
        return None
    return BoardView((corners + 0.5) * np.array([width / size[0], height / size[1]]) - 0.5, places)
