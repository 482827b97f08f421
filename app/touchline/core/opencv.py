"""OpenCV functions that differ between versions or that several packages use, with one shape for points: (n, 2).

OpenCV 5 returns (N, 2) where OpenCV 4 returned (N, 1, 2).
"""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points


def points_from_cv(array: NDArray[Any] | None) -> Points:
    """Any of OpenCV's point shapes, or None, as float64 (N, 2)."""
    if array is None:
        return np.empty((0, 2))
    return np.asarray(array, dtype=np.float64).reshape(-1, 2)


def refine_corners(gray: NDArray[np.uint8], corners: Points, half_window: int) -> Points:
    """Chessboard corners (n, 2) to sub-pixel, in a window of 2 · half_window + 1."""
    fine = np.ascontiguousarray(corners.reshape(-1, 1, 2), np.float32)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-3)
    return points_from_cv(cv2.cornerSubPix(gray, fine, (half_window, half_window), (-1, -1), stop))


def find_chessboard(
    gray: NDArray[np.uint8], columns: int, rows: int, *, thorough: bool
) -> Points | None:
    """All columns × rows inner corners, row by row, or None. thorough: the sector-based finder, slower, finds more."""
    if thorough:
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(gray, (columns, rows), flags=flags)
    else:
        flags = (
            cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
        )
        found, corners = cv2.findChessboardCorners(gray, (columns, rows), flags=flags)
    corners = points_from_cv(corners)
    return corners if found and len(corners) == columns * rows else None


def find_charuco(
    gray: NDArray[np.uint8],
    columns: int,
    rows: int,
    square: float,
    marker: float,
    dictionary: str,
    legacy: bool,
) -> tuple[Points, NDArray[np.int64]]:
    """Inner corners that were seen, (n, 2), and their numbers row by row; columns and rows are of inner corners."""
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard((columns + 1, rows + 1), square, marker, table)
    board.setLegacyPattern(legacy)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(gray)
    if ids is None:
        return np.empty((0, 2)), np.empty(0, np.int64)
    return points_from_cv(corners), np.asarray(ids, np.int64).reshape(-1)


def fit_within(
    gray: NDArray[np.uint8], longest: int
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Shrink a picture to at most `longest` px on its longer side; return it and its scale (x, y), 1 where it fits."""
    height, width = gray.shape
    if max(height, width) <= longest:
        return gray, np.ones(2)
    scale = longest / max(height, width)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = np.asarray(cv2.resize(gray, size, interpolation=cv2.INTER_AREA), np.uint8)
    return small, np.array([size[0] / width, size[1] / height])


def shrink_to_width(pixels: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """A picture (h, w[, channels]) at most so wide; as it is where it fits."""
    if pixels.shape[1] <= width:
        return pixels
    size = width, max(1, round(pixels.shape[0] * width / pixels.shape[1]))
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)


def resize_grid(values: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Resize a grid of values bilinearly to width × height pixels, its corners on the corners; NaN spreads."""
    rows, columns = values.shape
    x, y = np.meshgrid(
        np.linspace(0, columns - 1, width, dtype=np.float32),
        np.linspace(0, rows - 1, height, dtype=np.float32),
    )
    return cv2.remap(
        values.astype(np.float32), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(float)


def viridis() -> NDArray[np.uint8]:
    """Return viridis: 256 BGR shades from dark to bright, distinct for colour-blind eyes as well."""
    return np.asarray(
        cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_VIRIDIS), np.uint8
    )[:, 0]


def draw_text(
    picture: NDArray[np.uint8], text: str, at: tuple[int, int], colour: tuple[int, int, int]
) -> None:
    """Draw small text into a picture; at is its lower left corner."""
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.42, colour, 1, cv2.LINE_AA)


def find_homography(a: Points, b: Points, limit_px: float) -> NDArray[np.float64] | None:
    """Return the homography (3, 3) that most matches (n, 2) agree with, within limit_px in b; None where none does."""
    found, _ = cv2.findHomography(a, b, cv2.USAC_MAGSAC, limit_px, maxIters=2000, confidence=0.9999)
    return None if found is None else np.asarray(found, np.float64)


def to_grey(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return one channel of a picture (h, w), (h, w, 3) BGR or (h, w, 4) BGRA."""
    if pixels.ndim == 2:
        return pixels
    code = cv2.COLOR_BGRA2GRAY if pixels.shape[2] == 4 else cv2.COLOR_BGR2GRAY
    return np.asarray(cv2.cvtColor(pixels, code), np.uint8)


def blurred_gradients(
    gray: NDArray[np.uint8], blur_px: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Brightness by x and by y, grey levels a px, of the picture blurred by a Gaussian."""
    soft = cv2.GaussianBlur(
        gray.astype(np.float32), (0, 0), blur_px, borderType=cv2.BORDER_REPLICATE
    )
    half = np.array([-0.5, 0.0, 0.5], np.float32)
    one = np.ones(1, np.float32)
    return (
        np.asarray(
            cv2.sepFilter2D(soft, cv2.CV_32F, half, one, borderType=cv2.BORDER_REPLICATE),
            np.float32,
        ),
        np.asarray(
            cv2.sepFilter2D(soft, cv2.CV_32F, one, half, borderType=cv2.BORDER_REPLICATE),
            np.float32,
        ),
    )
