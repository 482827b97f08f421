"""Small worlds of boards: a camera, a bowed board held before it in many ways, and the corners it shows, with noise."""

import cv2
import numpy as np

from app.board import Board, BoardView
from app.geometry import ImageSize
from app.models.board_state import matrices_from_vectors
from app.models.pinhole_lens import PinholeLens

SIZE = ImageSize(1280, 1024)
BOARD = Board("chessboard", 10, 10, 100.0)  # nearly a metre: what the field's builders print on a stiff plate
TRUTH = PinholeLens("brown-conrady", (-0.28, 0.09, 0.0006, -0.0004, 0, 0, 0, 0), 900.0, 1.0, (652.0, 498.0), SIZE)
FISHEYE = PinholeLens("fisheye", (-0.02, 0.004, -0.001, 0.0), 420.0, 1.0, (645.0, 505.0), SIZE)
PLAIN = ("k1", "k2", "p1", "p2", "k3")


def bowed(board: Board, bow_mm: tuple[float, float]) -> np.ndarray:
    """Corners (n, 3) of a board whose middle stands bow_mm above its edges, across x and across y."""
    places = board.places_mm.copy()
    half = places[-1, :2] / 2
    u, v = ((places[:, :2] - half) / half).T
    places[:, 2] = bow_mm[0] * (1 - u * u) + bow_mm[1] * (1 - v * v)
    return places


def views_of(truth: PinholeLens = TRUTH, count: int = 40, *, seed: int = 0, noise_px: float = 0.2,
             bow_mm: tuple[float, float] = (1.0, 0.0), board: Board = BOARD, tilt_deg: float = 40.0,
             stray_share: float = 0.0) -> tuple[BoardView, ...]:
    """count views with every corner inside the picture, near and far, turned and tilted, all over the picture.

    Tilts are even in ±tilt_deg about x and y; the board fills 0.55 to 1.25 of the picture's width. Strays are moved by
    up to 20 px.
    """
    rng = np.random.default_rng(seed)
    places, flat = bowed(board, bow_mm), board.places_mm
    middle = flat.mean(axis=0)
    size = np.array(tuple(truth.image_size))
    views = []
    while len(views) < count:
        ray = truth.rays(rng.uniform(0, 1, 2) * size)
        facing = toward(ray) @ matrices_from_vectors(rng.uniform(-1, 1, (1, 3)) * np.radians([tilt_deg, tilt_deg, 180]))[0]
        distance = 2 * middle[0] * rng.uniform(0.8, 1.8) * truth.focal_px / size[0]
        pixels = truth.project((places - middle) @ facing.T + ray * distance)
        if not (np.isfinite(pixels).all() and (pixels > 0).all() and (pixels < size - 1).all()):
            continue
        pixels = pixels + rng.normal(0, noise_px, pixels.shape) if noise_px else pixels
        strays = rng.random(len(pixels)) < stray_share
        pixels[strays] += rng.uniform(-1, 1, (int(strays.sum()), 2)) * 20
        views.append(BoardView(pixels, flat, f"view {len(views) + 1}"))
    return tuple(views)


def toward(ray: np.ndarray) -> np.ndarray:
    """The rotation that brings (0, 0, 1) to the unit ray, so that a tilt is one against the line of sight."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = np.linalg.norm(axis)
    return matrices_from_vectors((axis / max(sine, 1e-12) * np.arctan2(sine, ray[2]))[None])[0]


def picture_of(board: Board, homography: np.ndarray, size: tuple[int, int] = (1000, 800)) -> np.ndarray:
    """A grey picture of the board, its corner at mm (x, y) standing at homography (x, y, 1) px; antialiased."""
    scale, fine = 8, 4  # px of the drawing a millimetre, and sub-samples of the picture
    width, height = ((n + 1) * board.square_mm for n in (board.columns, board.rows))
    if board.kind == "charuco":
        drawn = _charuco(board, scale)
    else:
        y, x = np.mgrid[:round(height * scale), :round(width * scale)] // round(board.square_mm * scale)
        drawn = np.where((x + y) % 2 == 0, 20, 235).astype(np.uint8)
    drawn = cv2.copyMakeBorder(drawn, 80, 80, 80, 80, cv2.BORDER_CONSTANT, value=235)
    # A drawing's pixel centre p stands at mm (p + 0.5 - 80) / scale from the outer corner, the first inner one a square in.
    mm = np.array([[1 / scale, 0, (0.5 - 80) / scale - board.square_mm], [0, 1 / scale, (0.5 - 80) / scale - board.square_mm],
                   [0, 0, 1]])
    larger = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    seen = cv2.warpPerspective(drawn, larger @ homography @ mm, (size[0] * fine, size[1] * fine),
                               borderValue=200)
    return cv2.GaussianBlur(cv2.resize(seen, size, interpolation=cv2.INTER_AREA), (0, 0), 0.7)


def _charuco(board: Board, scale: int) -> np.ndarray:
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    printed = cv2.aruco.CharucoBoard((board.columns + 1, board.rows + 1), board.square_mm, board.marker_mm, table)
    printed.setLegacyPattern(board.legacy)
    side = round(board.square_mm * scale)
    return printed.generateImage(((board.columns + 1) * side, (board.rows + 1) * side), marginSize=0)
