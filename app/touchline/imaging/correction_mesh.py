"""Correction as a coarse grid: raw places at its nodes, between which a graphics processor interpolates.

Some thousand nodes stand for the millions of places of a correction map, so that whoever has the raw picture can draw
the corrected one at any zoom, and a model that changes costs a small upload.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize
from touchline.core.json_values import PointJson, SizeJson
from touchline.imaging.correction import CorrectedView
from touchline.models.contract import CameraModel

MAX_ERROR_PX = 0.025  # between the nodes: at the edge of a white line, two grey levels
FIRST_COLUMNS = 17
MAX_NODES = 513  # in a row or column
SPARE = 1.1  # more nodes than the error found asks for: it falls with their square only where the lens is even


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
        first, last = (-0.5 - self.view.margin_px, np.array(tuple(self.corrected_size)) - 0.5 + self.view.margin_px)
        step = (last - first) / (columns - 1, rows - 1)
        return {"view": "corrected", "columns": columns, "rows": rows, "margin_px": self.view.margin_px,
                "corrected_size": list(self.corrected_size), "image_size": list(self.image_size),
                "first": [first, first], "step": step.tolist(), "error_px": round(self.error_px, 4)}

    def data(self) -> bytes:
        """Return raw x and y of each node, row by row: little-endian float32."""
        return self.raw_px.astype("<f4").tobytes()


def correction_mesh(model: CameraModel, margin_px: int = 0, columns: int | None = None,
                    rows: int | None = None) -> CorrectionMesh:
    """Return the mesh of a model's corrected view: of so many nodes, else of as few as keep MAX_ERROR_PX.

    Where even MAX_NODES do not keep it, its error_px says so.
    """
    view = CorrectedView(margin_px)
    size = view.size(model)
    for count in (columns, rows):
        if count is not None and not 2 <= count <= MAX_NODES:
            raise BadInput(f"A mesh with {count} nodes in a row or column is not possible.", f"Use 2 to {MAX_NODES}.",
                           reason="bad-mesh")
    wanted = columns or (max(2, round((rows - 1) * size.width / size.height) + 1) if rows else FIRST_COLUMNS)
    while True:
        mesh = _mesh(model, view, min(wanted, MAX_NODES), rows)
        if columns or rows or mesh.error_px <= MAX_ERROR_PX or max(mesh.raw_px.shape) >= MAX_NODES:
            return mesh
        finer = SPARE * (mesh.error_px / MAX_ERROR_PX) ** 0.5  # interpolated linearly, it falls with the square
        wanted = 1 + int(np.ceil((wanted - 1) * min(finer, 4.0)))


def _mesh(model: CameraModel, view: CorrectedView, columns: int, rows: int | None) -> CorrectionMesh:
    """Return the mesh of so many columns, its cells about square unless the rows are given."""
    size = view.size(model)
    if rows is None:
        rows = min(MAX_NODES, max(2, 1 + int(np.ceil((columns - 1) * size.height / size.width))))
    x = np.linspace(-0.5, size.width - 0.5, 2 * columns - 1)  # and halfway between, where it is off most
    y = np.linspace(-0.5, size.height - 0.5, 2 * rows - 1)
    x_c = view.corrected_from_view(model, x[:, None] * [1.0, 0.0])[:, 0]
    y_c = view.corrected_from_view(model, y[:, None] * [0.0, 1.0])[:, 1, None]
    exact = np.stack(np.broadcast_arrays(*model.raw_from_corrected_grid(x_c, y_c)), axis=-1)
    nodes = exact[::2, ::2]
    off = np.hypot(*np.moveaxis(_halved(nodes) - exact, -1, 0))
    with np.errstate(invalid="ignore"):
        is_seen = ((exact > -1.0) & (exact < tuple(model.image_size))).all(axis=-1)
    return CorrectionMesh(nodes.astype(np.float32), view, model.corrected_size, model.image_size,
                          float(np.max(off, initial=0.0, where=is_seen & np.isfinite(off))))


def _halved(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nodes with what is interpolated halfway between them, (2 rows - 1, 2 columns - 1, 2)."""
    rows, columns, _ = nodes.shape
    finer = np.empty((2 * rows - 1, 2 * columns - 1, 2))
    finer[::2, ::2] = nodes
    finer[::2, 1::2] = (nodes[:, :-1] + nodes[:, 1:]) / 2
    finer[1::2] = (finer[:-1:2] + finer[2::2]) / 2
    return finer
