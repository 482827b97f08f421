"""A calibration board: its corners in millimetres, what one image showed of it, and its corners found in an image.

The board's frame: x along a row of corners, y along a column, z = 0 on its face, the first inner corner at (0, 0).
Only inner corners count, those where four squares meet.

A chessboard is found whole or not at all; of a ChArUco board those corners count whose markers could be read, so it
may reach beyond the image's edge, where lenses need corners most.

Where four squares meet, the gradient at every pixel is perpendicular to the line from the corner to that pixel; least
squares over a window give the corner (W. Förstner 1987, as cornerSubPix does). A window that reaches the next corner is
drawn to it, and one that is too small averages little noise: so each corner has its own, as large as its squares allow.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import cv2
import numpy as np
from annotated_types import Interval
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE, Array, Mask, Pixels, Points, as_points
from touchline.core.json_values import JsonObject, Whole, read
from touchline.core.opencv import find_charuco, find_chessboard, fit_within, refine_corners, to_grey
from touchline.core.statements import sentence

FORM = (
    'Send {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 30}: columns and rows of inner corners, '
    '3 to 100; or "kind": "charuco" with "marker_mm" and "dictionary" as well.'
)
# along one side; detectors accept no fewer
CornerCount = Annotated[int, Interval(ge=3, le=100), Whole()]
MIN_MM, MAX_MM = 0.01, 10_000  # of a square's or a marker's side
# The families that OpenCV prints, and how many markers each has. OpenCV is asked for no other name.
DICTIONARIES = {
    **{f"DICT_{n}X{n}_{count}": count for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)},
    "DICT_ARUCO_ORIGINAL": 1024,
    "DICT_APRILTAG_16h5": 30,
    "DICT_APRILTAG_25h9": 35,
    "DICT_APRILTAG_36h10": 2320,
    "DICT_APRILTAG_36h11": 587,
}
MAX_VIEWS = 1000
MAX_CORNERS = 10_000  # in one view
# views × corners of the fullest: 2000 views of a usual board, some hundred megabytes
MAX_PADDED_CORNERS = 300_000

# the longer side of the image in which corners are detected; at full size they are refined
DETECTION_PX = 1600
SLOW_DETECTION_PX = 1000  # the same for the slow detector, which takes seconds on more
QUICK_DETECTION_PX = 800  # and for the quick search: 20 to 40 ms
# half a window in squares: inside the four squares even when they are seen at an angle
WINDOW_SQUARES = 0.35
# below: too few pixels; above, nothing more is gained
MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX = 2, 16
MARKER_MARGIN = 0.9  # of the white rim around a marker: its black edge would draw the corner away


@dataclass(frozen=True)
class Board:
    """columns × rows inner corners, square_mm apart.

    legacy: a ChArUco board of OpenCV before 4.6, whose even rows of squares begin with a marker where newer ones begin
    with a black square.
    """

    kind: Literal["chessboard", "charuco"]
    columns: CornerCount
    rows: CornerCount
    square_mm: Annotated[float, Interval(ge=MIN_MM, le=MAX_MM)]
    marker_mm: float = 0.0
    dictionary: str = ""
    legacy: bool = False

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read a board; BadInput names what is not of its form."""
        board = read(cls, value, "The board", FORM, "bad-board")
        if board.kind == "chessboard":
            extra = [name for name in ("marker_mm", "dictionary", "legacy") if getattr(board, name)]
            if extra:
                raise _bad_board(f"A chessboard has no {extra[0]}.", FORM)
            return board
        if board.marker_mm < MIN_MM:
            raise _bad_board(f"The board: marker_mm is missing, or less than {MIN_MM:g}.", FORM)
        if board.marker_mm >= board.square_mm:
            raise _bad_board(
                f"Markers of {board.marker_mm:g} mm do not fit into squares of {board.square_mm:g} mm.",
                "Measure both: the marker is smaller than the square.",
            )
        if board.dictionary not in DICTIONARIES:
            raise _bad_board(
                f"Unknown marker dictionary: {board.dictionary[:40]!r}.",
                f"Use one of: {', '.join(DICTIONARIES)}.",
            )
        needed, available = (
            (board.columns + 1) * (board.rows + 1) // 2,
            DICTIONARIES[board.dictionary],
        )
        if needed > available:
            raise _bad_board(
                f"The board has {needed} markers; {board.dictionary} has only {available}.",
                "Choose the dictionary that the board was printed with.",
            )
        return board

    def to_json(self) -> JsonObject:
        plain = {
            "kind": self.kind,
            "columns": self.columns,
            "rows": self.rows,
            "square_mm": self.square_mm,
        }
        if self.kind == "chessboard":
            return plain
        return {
            **plain,
            "marker_mm": self.marker_mm,
            "dictionary": self.dictionary,
            "legacy": self.legacy,
        }

    @property
    def places_mm(self) -> Array:
        """Return where the inner corners are, (columns · rows, 3), row by row."""
        y, x = np.mgrid[: self.rows, : self.columns]
        return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) * self.square_mm

    @property
    def outline(self) -> list[int]:
        """Return which of places_mm are the outermost corners: (0, 0), (1, 0), (1, 1), (0, 1)."""
        return [0, self.columns - 1, self.columns * self.rows - 1, self.columns * (self.rows - 1)]


@dataclass(frozen=True, eq=False)
class BoardView:
    """The corners of one image: pixels (n, 2) raw, places_mm (n, 3) on the board. name: for messages."""

    pixels: Points
    places_mm: Array
    name: str = ""

    def __post_init__(self) -> None:
        if len(self.pixels) != len(self.places_mm):
            raise BadInput(
                sentence(
                    f"{self.name or 'A view'} has {len(self.pixels)} points in the image and "
                    f"{len(self.places_mm)} on the board."
                ),
                "Give one of each for every corner.",
                reason="bad-view",
            )
        for array in (self.pixels, self.places_mm):
            array.setflags(write=False)

    def only(self, keep: Mask) -> "BoardView":
        """Return the view with some of its corners. keep (n,)."""
        return BoardView(self.pixels[keep], self.places_mm[keep], self.name)

    def to_json(self) -> JsonObject:
        return {
            "image_points": self.pixels.tolist(),
            "object_points": self.places_mm.tolist(),
            "name": self.name,
        }


def views_from_json(value: Any) -> tuple[BoardView, ...]:
    """Read [{"image_points": [[x, y], …] px, "object_points": [[X, Y, Z], …] mm}, …]; BadInput names the wrong view."""
    form = 'Send [{"image_points": [[x, y], …], "object_points": [[X, Y, Z], …]}, …], millimetres on the board.'
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise BadInput("The views are not a list.", form, reason="bad-view")
    if len(value) > MAX_VIEWS:
        raise BadInput(
            f"{len(value)} views were sent; a calibration accepts at most {MAX_VIEWS}.",
            "Send fewer: more than a few dozen well-spread views improve the result only slightly.",
            reason="too-many-views",
        )
    views = []
    for number, item in enumerate(value, 1):
        if not isinstance(item, Mapping) or set(item) - {"image_points", "object_points", "name"}:
            raise BadInput(
                f"View {number} does not have the format of a view.", form, reason="bad-view"
            )
        name = str(item.get("name") or f"view {number}")[:200]
        pixels = as_points(item.get("image_points", ()), f"The image points of {name}").reshape(
            -1, 2
        )
        if len(pixels) > MAX_CORNERS:
            raise BadInput(
                sentence(f"{name} has {len(pixels)} corners; at most {MAX_CORNERS} are possible."),
                "Use a board with fewer squares.",
                reason="too-many-points",
            )
        views.append(BoardView(pixels, _read_places(item.get("object_points", ()), name), name))
    fullest = max((len(view.pixels) for view in views), default=0)
    if len(views) * fullest > MAX_PADDED_CORNERS:
        raise BadInput(
            f"{len(views)} views with up to {fullest} corners exceed the limit of a calibration.",
            "Send fewer views.",
            reason="too-many-points",
        )
    return tuple(views)


def _read_places(value: Any, name: str) -> Array:
    try:
        places = np.array(value, dtype=np.float64)
        if places.size and (places.ndim != 2 or places.shape[1] not in (2, 3)):
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise BadInput(
            f"The object points of {name} are not lists of three numbers.",
            "Send [[X, Y, Z], …] in mm.",
            reason="bad-view",
        ) from None
    places = places.reshape(-1, places.shape[-1] if places.size else 3)
    if not (np.abs(places) <= MAX_COORDINATE).all():
        raise BadInput(
            f"The object points of {name} contain a number that is not finite or too large.",
            "Correct the number.",
            reason="non-finite-points",
        )
    return places if places.shape[1] == 3 else np.pad(places, ((0, 0), (0, 1)))


def _bad_board(what: str, fix: str) -> BadInput:
    return BadInput(what, fix, reason="bad-board")


Grey = NDArray[np.uint8]  # (h, w)


def find_board(pixels: Pixels, board: Board, name: str = "") -> BoardView | None:
    """Find the board, its corners refined at full size; None where the image shows none."""
    grey = _luminance(pixels)
    if board.kind == "charuco":
        return _find_charuco_board(grey, board, name)
    corners = _find_chessboard_corners(grey, board)
    if corners is None:
        return None
    places = board.places_mm
    return BoardView(
        refine_corners_by_square(grey, corners, places[:, :2] / board.square_mm), places, name
    )


def find_board_quickly(pixels: Pixels, board: Board) -> BoardView | None:
    """Find the board in a reduced image, to about half a pixel of its own; None where there is none.

    For live guidance while a board is held up. A lens is fitted to corners of the stored image (find_board).
    """
    height, width = pixels.shape[:2]
    scale = min(1.0, QUICK_DETECTION_PX / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = (
        pixels
        if scale == 1.0
        else np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)
    )
    grey = to_grey(small)
    corners, places = (
        _charuco_corners(grey, board)
        if board.kind == "charuco"
        else (find_chessboard(grey, board.columns, board.rows, thorough=False), board.places_mm)
    )
    if corners is None or not len(corners):
        return None
    return BoardView((corners + 0.5) * np.array([width / size[0], height / size[1]]) - 0.5, places)


def refine_corners_by_square(
    grey: Grey, corners: Points, squares: Array, reach: float = WINDOW_SQUARES
) -> Points:
    """Refine corners (n, 2) px, each in its own window; one that would leave its window stays where it was.

    squares (n, 2): where they are on the board, in squares. reach: how far the four squares are plain, in squares.
    """
    if len(corners) < 2:
        return corners
    half_windows = np.clip(
        (reach * _square_px(corners, squares)).astype(int), MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX
    )
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
    return BoardView(
        refine_corners_by_square(grey, corners, places[:, :2] / board.square_mm, reach),
        places,
        name,
    )


def _charuco_corners(grey: Grey, board: Board) -> tuple[Points, Array]:
    """Return the corners (n, 2) px that were found, and their places (n, 3) mm."""
    corners, numbers = find_charuco(
        grey,
        board.columns,
        board.rows,
        board.square_mm,
        board.marker_mm,
        board.dictionary,
        board.legacy,
    )
    return corners, board.places_mm[numbers]


def _luminance(pixels: Pixels) -> Grey:
    """Return luminance, rounded. pixels: grey, or blue, green, red."""
    if pixels.ndim == 2:
        return np.ascontiguousarray(pixels)
    weights = np.array([0.114, 0.587, 0.299], np.float32)
    return np.rint(pixels[..., :3].astype(np.float32) @ weights).astype(np.uint8)
