"""The inner corners of a chessboard or ChArUco board in an image, to a few hundredths of a pixel.

A chessboard is found whole or not at all; of a ChArUco board those corners count whose markers could be read, so it
may reach beyond the image's edge, where lenses need corners most.

Where four squares meet, the gradient at every pixel is perpendicular to the line from the corner to that pixel; least
squares over a window give the corner (W. Förstner 1987, as cornerSubPix does). A window that reaches the next corner is
drawn to it, and one that is too small averages little noise: so each corner has its own, as large as its squares allow.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.boards.board import Board, BoardView
from touchline.core.geometry import Array, Pixels, Points
from touchline.core.opencv import find_charuco, find_chessboard, fit_within, refine_corners, to_grey

Grey = NDArray[np.uint8]  # (h, w)

DETECTION_PX = 1600  # the longer side of the image in which corners are detected; at full size they are refined
SLOW_DETECTION_PX = 1000  # the same for the slow detector, which takes seconds on more
QUICK_DETECTION_PX = 800  # and for the quick search: 20 to 40 ms
WINDOW_SQUARES = 0.35  # half a window in squares: inside the four squares even when they are seen at an angle
MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX = 2, 16  # below: too few pixels; above, nothing more is gained
MARKER_MARGIN = 0.9  # of the white rim around a marker: its black edge would draw the corner away


def find_board(pixels: Pixels, board: Board, name: str = "") -> BoardView | None:
    """Find the board, its corners refined at full size; None where the image shows none."""
    grey = _luminance(pixels)
    if board.kind == "charuco":
        return _find_charuco_board(grey, board, name)
    corners = _find_chessboard_corners(grey, board)
    if corners is None:
        return None
    places = board.places_mm
    return BoardView(refine_corners_by_square(grey, corners, places[:, :2] / board.square_mm), places, name)


def find_board_quickly(pixels: Pixels, board: Board) -> BoardView | None:
    """Find the board in a reduced image, to about half a pixel of its own; None where there is none.

    For live guidance while a board is held up. A lens is fitted to corners of the stored image (find_board).
    """
    height, width = pixels.shape[:2]
    scale = min(1.0, QUICK_DETECTION_PX / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = pixels if scale == 1.0 else np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)
    grey = to_grey(small)
    corners, places = (_charuco_corners(grey, board) if board.kind == "charuco" else
                       (find_chessboard(grey, board.columns, board.rows, thorough=False), board.places_mm))
    if corners is None or not len(corners):
        return None
    return BoardView((corners + 0.5) * np.array([width / size[0], height / size[1]]) - 0.5, places)


def refine_corners_by_square(grey: Grey, corners: Points, squares: Array, reach: float = WINDOW_SQUARES) -> Points:
    """Refine corners (n, 2) px, each in its own window; one that would leave its window stays where it was.

    squares (n, 2): where they are on the board, in squares. reach: how far the four squares are plain, in squares.
    """
    if len(corners) < 2:
        return corners
    half_windows = np.clip((reach * _square_px(corners, squares)).astype(int), MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX)
    refined = corners.copy()
    for half in np.unique(half_windows):
        same = half_windows == half
        refined[same] = refine_corners(grey, corners[same], int(half))
    left_window = np.abs(refined - corners).max(axis=1) > half_windows
    return np.where(left_window[:, None], corners, refined)


def _square_px(corners: Points, squares: Array) -> Array:
    """Return the shortest side of a square at each corner (n,), px; the board's median where no neighbour was found."""
    # A grid of corner numbers with an empty rim, so that each corner has four neighbours; -1: no corner there.
    cells = np.rint(squares - squares.min(axis=0)).astype(int) + 1
    number_at = np.full(cells.max(axis=0) + 2, -1)
    number_at[cells[:, 0], cells[:, 1]] = np.arange(len(corners))
    sides = np.full(len(corners), np.inf)
    for across, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        neighbour = number_at[cells[:, 0] + across, cells[:, 1] + down]
        distance = np.linalg.norm(corners - corners[neighbour], axis=1)
        sides = np.where(neighbour >= 0, np.minimum(sides, distance), sides)
    known = np.isfinite(sides)
    return np.where(known, sides, np.median(sides[known]) if known.any() else 0.0)


def _find_chessboard_corners(grey: Grey, board: Board) -> Points | None:
    """Try the quick detector, and where it fails the thorough one."""
    for longest, thorough in ((DETECTION_PX, False), (SLOW_DETECTION_PX, True)):
        small, scale = fit_within(grey, longest)
        corners = find_chessboard(small, board.columns, board.rows, thorough=thorough)
        if corners is not None:
            return (corners + 0.5) / scale - 0.5
    return None


def _find_charuco_board(grey: Grey, board: Board, name: str) -> BoardView | None:
    corners, places = _charuco_corners(grey, board)
    if not len(corners):
        return None
    rim = (board.square_mm - board.marker_mm) / 2 / board.square_mm
    reach = min(WINDOW_SQUARES, MARKER_MARGIN * rim)
    return BoardView(refine_corners_by_square(grey, corners, places[:, :2] / board.square_mm, reach), places, name)


def _charuco_corners(grey: Grey, board: Board) -> tuple[Points, Array]:
    """Return the corners (n, 2) px that were found, and their places (n, 3) mm."""
    corners, numbers = find_charuco(grey, board.columns, board.rows, board.square_mm, board.marker_mm,
                                    board.dictionary, board.legacy)
    return corners, board.places_mm[numbers]


def _luminance(pixels: Pixels) -> Grey:
    """Return luminance, rounded. pixels: grey, or blue, green, red."""
    if pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    weights = np.array([0.114, 0.587, 0.299], np.float32)
    return np.rint(pixels[..., :3].astype(np.float32) @ weights).astype(np.uint8)
