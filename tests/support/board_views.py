"""Small worlds of boards: a camera, a bowed board held before it in many ways, and the corners it shows, with noise."""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import numpy as np

from touchline.boards.board import Board, BoardView
from touchline.core.geometry import ImageSize
from touchline.models.intrinsics import Intrinsics, lens_difference
from touchline.models.rotation import matrix_from_vector

SIZE = ImageSize(1280, 1024)
# nearly a metre: what the field's builders print on a stiff plate
BOARD = Board("chessboard", 10, 10, 100.0)
TRUTH = Intrinsics(
    "brown-conrady", (-0.28, 0.09, 0.0006, -0.0004, 0, 0, 0, 0), 900.0, 1.0, (652.0, 498.0), SIZE
)
FISHEYE = Intrinsics("fisheye", (-0.02, 0.004, -0.001, 0.0), 420.0, 1.0, (645.0, 505.0), SIZE)
TRIES = 50  # poses at a time, of which those inside the picture stay
PLAIN = ("k1", "k2", "p1", "p2", "k3")


def bowed(board: Board, bow_mm: tuple[float, float]) -> np.ndarray:
    """Corners (n, 3) of a board whose middle stands bow_mm above its edges, across x and across y."""
    places = board.places_mm.copy()
    half = places[-1, :2] / 2
    u, v = ((places[:, :2] - half) / half).T
    places[:, 2] = bow_mm[0] * (1 - u * u) + bow_mm[1] * (1 - v * v)
    return places


def views_of(
    truth: Intrinsics = TRUTH,
    count: int = 40,
    *,
    seed: int = 0,
    noise_px: float = 0.2,
    bow_mm: tuple[float, float] = (1.0, 0.0),
    board: Board = BOARD,
    tilt_deg: float = 40.0,
    stray_share: float = 0.0,
) -> tuple[BoardView, ...]:
    """count views with every corner inside the picture, near and far, turned and tilted, all over the picture.

    Tilts against the camera's axis are even in ±tilt_deg about x and y; face on, in the middle, the board fills 0.6 to
    1.4 of the picture's width. Strays are moved by up to 20 px.
    """
    rng = np.random.default_rng(seed)
    places, flat = bowed(board, bow_mm), board.places_mm
    middle = flat.mean(axis=0)
    outline = [0, board.columns - 1, -1, -board.columns]
    size = np.array(tuple(truth.image_size))
    views: list[BoardView] = []
    while len(views) < count:
        turns = matrix_from_vector(
            rng.uniform(-1, 1, (TRIES, 3)) * np.radians([tilt_deg, tilt_deg, 180])
        )
        spots = truth.rays(rng.uniform(0, 1, (TRIES, 2)) * size)
        distances = 2 * middle.max() * rng.uniform(0.7, 1.6, TRIES) * truth.focal_px / size[0]
        seen = (places - middle) @ turns.transpose(0, 2, 1) + (spots * distances[:, None])[:, None]
        inside = _inside(truth.project(seen[:, outline]), size)
        for points in seen[inside]:
            pixels = truth.project(points)
            if _inside(pixels, size) and len(views) < count:
                pixels = pixels + rng.normal(0, noise_px, pixels.shape) if noise_px else pixels
                strays = rng.random(len(pixels)) < stray_share
                pixels[strays] += rng.uniform(-1, 1, (int(strays.sum()), 2)) * 20
                views.append(BoardView(pixels, flat, f"view {len(views) + 1}"))
    return tuple(views)


def zoomed_views(growth: Iterable[float], *, seed: int = 0) -> tuple[BoardView, ...]:
    """One view for each growth of TRUTH's focal length, as a share of it, in this order."""
    views = (
        views_of(replace(TRUTH, focal_px=TRUTH.focal_px * (1 + more)), 1, seed=1000 * seed + i)[0]
        for i, more in enumerate(growth)
    )
    return tuple(
        BoardView(view.pixels, view.places_mm, f"view {i + 1}") for i, view in enumerate(views)
    )


def walked(views: Iterable[BoardView], how: str) -> tuple[BoardView, ...]:
    """The same views in the order of an operator who walks: "across", "down", "away" or "outwards"."""
    size = np.array(tuple(SIZE))
    by = {
        "across": lambda view: view.pixels[:, 0].mean(),
        "down": lambda view: view.pixels[:, 1].mean(),
        "away": lambda view: -np.ptp(view.pixels, axis=0).max(),
        "outwards": lambda view: np.linalg.norm(view.pixels.mean(axis=0) - size / 2),
    }
    return tuple(sorted(views, key=by[how]))


def median_difference(first: Intrinsics, second: Intrinsics) -> float:
    """Median length over the picture, px, of how the lenses differ once each may be turned."""
    return float(np.nanmedian(np.linalg.norm(lens_difference(first, second), axis=-1)))


def _inside(pixels: np.ndarray, size: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.all((pixels > 0) & (pixels < size - 1), axis=(-2, -1))


def picture_of(
    board: Board, homography: np.ndarray, size: tuple[int, int] = (1000, 800)
) -> np.ndarray:
    """A grey picture of the board, its corner at mm (x, y) standing at homography (x, y, 1) px; antialiased."""
    scale, fine = 8, 4  # px of the drawing a millimetre, and sub-samples of the picture
    width, height = ((n + 1) * board.square_mm for n in (board.columns, board.rows))
    if board.kind == "charuco":
        drawn = _charuco(board, scale)
    else:
        y, x = np.mgrid[: round(height * scale), : round(width * scale)] // round(
            board.square_mm * scale
        )
        drawn = np.where((x + y) % 2 == 0, 20, 235).astype(np.uint8)
    drawn = cv2.copyMakeBorder(drawn, 80, 80, 80, 80, cv2.BORDER_CONSTANT, value=235)
    # A drawing's pixel centre p stands (p + 0.5 - 80) / scale mm from the outer corner, a square before an inner one.
    begin = (0.5 - 80) / scale - board.square_mm
    mm = np.array([[1 / scale, 0, begin], [0, 1 / scale, begin], [0, 0, 1]])
    larger = np.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    seen = cv2.warpPerspective(
        drawn, larger @ homography @ mm, (size[0] * fine, size[1] * fine), borderValue=200
    )
    return cv2.GaussianBlur(cv2.resize(seen, size, interpolation=cv2.INTER_AREA), (0, 0), 0.7)


def _charuco(board: Board, scale: int) -> np.ndarray:
    table = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    printed = cv2.aruco.CharucoBoard(
        (board.columns + 1, board.rows + 1), board.square_mm, board.marker_mm, table
    )
    printed.setLegacyPattern(board.legacy)
    side = round(board.square_mm * scale)
    return printed.generateImage(
        ((board.columns + 1) * side, (board.rows + 1) * side), marginSize=0
    )
