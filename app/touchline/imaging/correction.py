"""Correction: a model becomes a map, or a coarse grid, and the map makes the corrected picture; the only remap.

The map says for each corrected pixel where it lies in the raw picture, in one pass. It can be made straight for the
size that is watched, with a margin around the field, so that nothing is ever resampled twice.

A mesh is the map as a coarse grid: some thousand nodes stand for the millions of places of a correction map, so that
whoever has the raw picture can draw the corrected one at any zoom, and a model that changes costs a small upload.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize, Points
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import PointJson, SizeJson
from touchline.core.records import Calibration
from touchline.models.contract import CameraModel, Rectification

BLOCK_PX = 1 << 15  # so many pixels at a time stay in the processor's cache
MAX_MAP_PX = 50e6
MAX_ENLARGED_PX = 16e6  # of a view with a margin or a width: some seconds, and 0.4 GB
BORDER_BGR = (24, 20, 16)  # what the raw picture does not show

MAX_ERROR_PX = 0.025  # between the nodes: at the edge of a white line, two grey levels
FIRST_COLUMNS = 17
MAX_NODES = 513  # in a row or column
# more nodes than the error found asks for: it falls with their square only where the lens is even
SPARE = 1.1


@dataclass(frozen=True)
class CorrectedView:
    """Which part of the corrected frame is drawn, and how large.

    margin_px: corrected pixels shown around the field on each side. width: of the picture that is drawn, px;
    None draws one pixel per corrected pixel.
    """

    margin_px: int = 0
    width: int | None = None

    def size(self, model: Rectification | Calibration) -> ImageSize:
        natural = self._natural(model)
        if self.width is None:
            return natural
        return ImageSize(self.width, max(2, round(natural.height * self.width / natural.width)))

    def drawn_size(self, model: Rectification) -> ImageSize:
        """Return the size; BadInput where it is too large to draw."""
        size, natural = self.size(model), model.corrected_size
        if size.width * size.height > min(
            max(natural.width * natural.height, MAX_ENLARGED_PX), MAX_MAP_PX
        ):
            raise BadInput(
                f"A corrected image of {size} is too large.",
                "Choose a smaller margin, width or rectangle size.",
                reason="bad-view",
            )
        return size

    def _natural(self, model: Rectification | Calibration) -> ImageSize:
        corrected = model.corrected_size
        if not 0 <= self.margin_px <= 4096:
            raise BadInput(
                f"A margin of {self.margin_px} px is not possible.",
                "Use 0 to 4096.",
                reason="bad-view",
            )
        if self.width is not None and not 16 <= self.width <= 8192:
            raise BadInput(
                f"A width of {self.width} px is not possible.", "Use 16 to 8192.", reason="bad-view"
            )
        return ImageSize(
            corrected.width + 2 * self.margin_px, corrected.height + 2 * self.margin_px
        )

    def corrected_from_view(self, model: Rectification, points: Points) -> Points:
        """Pixels of the drawn picture to corrected pixels."""
        return (points + 0.5) / self._scale(model) - 0.5 - self.margin_px

    def view_from_corrected(self, model: Rectification, points: Points) -> Points:
        """Corrected pixels to pixels of the drawn picture."""
        return (points + self.margin_px + 0.5) * self._scale(model) - 0.5

    def _scale(self, model: Rectification) -> Points:
        return np.array(
            [a / b for a, b in zip(self.size(model), self._natural(model), strict=True)]
        )


@dataclass(frozen=True, eq=False)
class CorrectionMap:
    """raw_from_view at every pixel: raw_x, raw_y (height, width) float32 px; NaN where the model does not reach."""

    raw_x: NDArray[np.float32]
    raw_y: NDArray[np.float32]

    def apply(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The corrected picture of a raw (h, w[, channels]), bilinear, places rounded to 1/32 px: for live views."""
        return self._remap(pixels, cv2.INTER_LINEAR)

    def apply_finely(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The same, bicubic: a fifth of the error on fine detail for three times the time; for stills."""
        return self._remap(pixels, cv2.INTER_CUBIC)

    def _remap(self, pixels: NDArray[np.uint8], interpolation: int) -> NDArray[np.uint8]:
        return np.asarray(
            cv2.remap(
                pixels,
                *self._fixed,
                interpolation,
                borderMode=cv2.BORDER_CONSTANT,
                borderValue=BORDER_BGR,
            ),
            np.uint8,
        )

    @cached_property
    def _fixed(self) -> tuple[NDArray, NDArray]:
        """OpenCV's quicker pair of maps: int16 places and an index into 32 × 32 weights; NaN becomes outside."""
        outside = -30_000.0  # fits int16, and no picture begins there
        x, y = (
            np.clip(np.nan_to_num(m, nan=outside), outside, -outside)
            for m in (self.raw_x, self.raw_y)
        )
        return cv2.convertMaps(x, y, cv2.CV_16SC2)


def correction_map(
    model: Rectification, view: CorrectedView = CorrectedView(), progress: Progress = no_progress
) -> CorrectionMap:
    """The map for one view of one model."""
    size = view.drawn_size(model)
    raw_x = np.empty((size.height, size.width), np.float32)
    raw_y = np.empty_like(raw_x)
    x_c = view.corrected_from_view(model, np.arange(size.width)[:, None] * [1.0, 0.0])[:, 0]
    y_c = view.corrected_from_view(model, np.arange(size.height)[:, None] * [0.0, 1.0])[:, 1, None]
    step = max(1, BLOCK_PX // size.width)
    for top in range(0, size.height, step):
        progress(top / size.height, "Correcting")
        block = slice(top, top + step)
        raw_x[block], raw_y[block] = model.raw_from_corrected_grid(x_c, y_c[block])
    return CorrectionMap(raw_x, raw_y)


class MeshHeader(TypedDict):
    """What a reader needs beside the numbers; first, step: corrected pixels of the nodes."""

    view: Literal["corrected"]
    columns: int
    rows: int
    margin_px: int
    corrected_size: SizeJson
    image_size: SizeJson
    first: PointJson
    step: PointJson
    error_px: float


@dataclass(frozen=True, eq=False)
class CorrectionMesh:
    """raw_px (rows, columns, 2) float32, NaN out of reach: raw pixels at nodes spread evenly over a corrected view.

    The outer nodes lie on the view's outer edges, half a pixel outside the centres of its outer pixels.
    error_px: the most by which a place between four nodes is off, of those that the raw picture shows.
    """

    raw_px: NDArray[np.float32]
    view: CorrectedView
    corrected_size: ImageSize
    image_size: ImageSize
    error_px: float

    def header(self) -> MeshHeader:
        rows, columns, _ = self.raw_px.shape
        first, last = (
            -0.5 - self.view.margin_px,
            np.array(tuple(self.corrected_size)) - 0.5 + self.view.margin_px,
        )
        step = (last - first) / (columns - 1, rows - 1)
        return {
            "view": "corrected",
            "columns": columns,
            "rows": rows,
            "margin_px": self.view.margin_px,
            "corrected_size": list(self.corrected_size),
            "image_size": list(self.image_size),
            "first": [first, first],
            "step": step.tolist(),
            "error_px": round(self.error_px, 4),
        }

    def data(self) -> bytes:
        """Return raw x and y of each node, row by row: little-endian float32."""
        return self.raw_px.astype("<f4").tobytes()


def correction_mesh(
    model: CameraModel, margin_px: int = 0, columns: int | None = None, rows: int | None = None
) -> CorrectionMesh:
    """Return the mesh of a model's corrected view: of so many nodes, else of as few as keep MAX_ERROR_PX.

    Where even MAX_NODES do not keep it, its error_px says so.
    """
    view = CorrectedView(margin_px)
    size = view.size(model)
    for count in (columns, rows):
        if count is not None and not 2 <= count <= MAX_NODES:
            raise BadInput(
                f"A mesh with {count} nodes in a row or column is not possible.",
                f"Use 2 to {MAX_NODES}.",
                reason="bad-mesh",
            )
    wanted = columns or (
        max(2, round((rows - 1) * size.width / size.height) + 1) if rows else FIRST_COLUMNS
    )
    while True:
        mesh = _mesh(model, view, min(wanted, MAX_NODES), rows)
        if columns or rows or mesh.error_px <= MAX_ERROR_PX or max(mesh.raw_px.shape) >= MAX_NODES:
            return mesh
        # interpolated linearly, it falls with the square
        finer = SPARE * (mesh.error_px / MAX_ERROR_PX) ** 0.5
        wanted = 1 + int(np.ceil((wanted - 1) * min(finer, 4.0)))


def _mesh(
    model: CameraModel, view: CorrectedView, columns: int, rows: int | None
) -> CorrectionMesh:
    """Return the mesh of so many columns, its cells about square unless the rows are given."""
    size = view.size(model)
    if rows is None:
        rows = min(MAX_NODES, max(2, 1 + int(np.ceil((columns - 1) * size.height / size.width))))
    # and halfway between, where it is off most
    x = np.linspace(-0.5, size.width - 0.5, 2 * columns - 1)
    y = np.linspace(-0.5, size.height - 0.5, 2 * rows - 1)
    x_c = view.corrected_from_view(model, x[:, None] * [1.0, 0.0])[:, 0]
    y_c = view.corrected_from_view(model, y[:, None] * [0.0, 1.0])[:, 1, None]
    exact = np.stack(np.broadcast_arrays(*model.raw_from_corrected_grid(x_c, y_c)), axis=-1)
    nodes = exact[::2, ::2]
    off = np.hypot(*np.moveaxis(_halved(nodes) - exact, -1, 0))
    with np.errstate(invalid="ignore"):
        is_seen = ((exact > -1.0) & (exact < tuple(model.image_size))).all(axis=-1)
    return CorrectionMesh(
        nodes.astype(np.float32),
        view,
        model.corrected_size,
        model.image_size,
        float(np.max(off, initial=0.0, where=is_seen & np.isfinite(off))),
    )


def _halved(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nodes with what is interpolated halfway between them, (2 rows - 1, 2 columns - 1, 2)."""
    rows, columns, _ = nodes.shape
    finer = np.empty((2 * rows - 1, 2 * columns - 1, 2))
    finer[::2, ::2] = nodes
    finer[::2, 1::2] = (nodes[:, :-1] + nodes[:, 1:]) / 2
    finer[1::2] = (finer[:-1:2] + finer[2::2]) / 2
    return finer
