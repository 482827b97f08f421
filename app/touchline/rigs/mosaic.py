"""The whole field in one picture: each camera corrected straight to where the field is drawn, seams feathered.

    view pixel → field mm → raw pixel of each camera, one remap a camera
    weight = how far inside the raw picture (a ramp at its edge) × how far inside the camera's own region

A camera shows its region; beside it, it only fills what no other camera shows. Where no camera sees, hatching stands
and `unseen` says so.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Literal, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import Array, ImageSize, Points, inside_picture
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import PointJson
from touchline.core.statements import say
from touchline.imaging.correction import BLOCK_PX, BORDER_BGR, CorrectionMap
from touchline.models import CameraModel, model_of, raw_from_field
from touchline.rigs.rig import Range, Rig

MAX_PX = 6e6  # 5 s, and 1 GB where two cameras both see all of the field
MARGIN_MM = 300.0  # of carpet around the lines
FEATHER_MM = 200.0  # of a seam between two regions, on either side
FEATHER_PX = 40.0  # raw, at a picture's edge
FILL_WEIGHT = 1e-3  # a camera's weight beside its region
HATCH_PX, HATCH_BGR = 14, (52, 44, 38)
FULL_WEIGHT = 0.998  # a weight beyond that is all


class PaintedLine(TypedDict):
    feature: str
    kind: Literal["line", "arc"]
    points: list[PointJson]


class Unseen(TypedDict):
    """The part of the field that no camera sees, its area, the range in which it is, mm, and the same in words."""

    share: float
    m2: float
    where: Range | None
    words: str


class CameraShare(TypedDict):
    camera: str
    share: float


class StitchedView(TypedDict):
    """Where things lie in stitched.jpg of that width. corner: field mm at its first and last pixel."""

    width: int
    height: int
    px_per_mm: float
    overlay: list[PaintedLine]
    corner: list[PointJson]
    unseen: Unseen
    cameras: list[CameraShare]


@dataclass(frozen=True)
class FieldView:
    """The field as it is drawn: x to the right, y up, `width` px wide with a margin around its lines."""

    field: Field
    width: int
    margin_mm: float = MARGIN_MM

    def __post_init__(self) -> None:
        if not 64 <= self.width <= 8192:
            raise BadInput(
                f"A width of {self.width} px is not possible.", "Use 64 to 8192.", reason="bad-view"
            )
        if self.size.width * self.size.height > MAX_PX:
            raise BadInput(
                f"An image of {self.size} is too large.",
                "Choose a smaller width.",
                reason="bad-view",
            )

    @property
    def px_per_mm(self) -> float:
        return self.width / (self.field.length_mm + 2 * self.margin_mm)

    @property
    def size(self) -> ImageSize:
        return ImageSize(
            self.width, max(2, round((self.field.width_mm + 2 * self.margin_mm) * self.px_per_mm))
        )

    @property
    def _corner(self) -> Points:
        return np.array(
            [-self.field.length_mm / 2 - self.margin_mm, self.field.width_mm / 2 + self.margin_mm]
        )

    def view_from_field(self, points: Points) -> Points:
        return (points - self._corner) * [self.px_per_mm, -self.px_per_mm] - 0.5

    def field_from_view(self, points: Points) -> Points:
        return (points + 0.5) / [self.px_per_mm, -self.px_per_mm] + self._corner

    def field_from_view_corner(self) -> list[PointJson]:
        """The field's places at the picture's first and last pixel, mm."""
        size = self.size
        return self.field_from_view(
            np.array([[0.0, 0.0], [size.width - 1.0, size.height - 1.0]])
        ).tolist()

    def overlay(self) -> list[PaintedLine]:
        """All that is painted, as polylines in view pixels."""
        shapes: list[Line | Arc] = [*self.field.lines.values(), *self.field.arcs.values()]
        return [
            {
                "feature": shape.name,
                "kind": "arc" if isinstance(shape, Arc) else "line",
                "points": self.view_from_field(
                    shape.sample(65 if isinstance(shape, Arc) else 2)
                ).tolist(),
            }
            for shape in shapes
        ]


@dataclass(frozen=True, eq=False)
class MosaicTile:
    """One camera's share: where in the view (rows, columns), its map there, and where it alone is shown."""

    window: tuple[slice, slice]
    map: CorrectionMap
    alone: NDArray[np.uint8]  # 255 where no other camera shows
    # flat place in the window for each of the stitcher's seam; 0 where it shows nothing
    seam: NDArray[np.int64]
    weight: NDArray[np.float32]  # (n, 3) of those
    size: ImageSize


@dataclass(frozen=True, eq=False)
class Stitcher:
    """Made once for a rig at a width; stitch() is one remap a camera. parts: None for one that is not shown at all.

    seam: flat places (n,) of the view that are blended from more than one camera.
    """

    view: FieldView
    parts: tuple[MosaicTile | None, ...]
    seam: NDArray[np.int64]
    background: NDArray[np.uint8]
    unseen: NDArray[np.bool_]
    shown_share: tuple[float, ...]

    @classmethod
    def of(
        cls,
        cameras: Sequence[tuple[CameraModel, ImageSize, Region]],
        view: FieldView,
        progress: Progress = no_progress,
    ) -> Self:
        """cameras: model, size of its raw picture, and the region that it shows first."""
        if not cameras:
            raise FitFailed(
                say(
                    "rig.nothing-to-stitch",
                    "No camera of this rig has both a calibration and an image.",
                ),
                say("rig.nothing-to-stitch.fix", "Calibrate the cameras and start their images."),
                reason="nothing-to-stitch",
            )
        size = view.size
        raws = np.empty((len(cameras), size.height, size.width, 2), np.float32)
        weights = np.empty((len(cameras), size.height, size.width), np.float32)
        step = max(1, BLOCK_PX // size.width)
        # by blocks: what each needs is many times what is kept of it
        for top in range(0, size.height, step):
            progress(top / size.height, "Drawing the field")
            rows = slice(top, min(top + step, size.height))
            for number, (model, _, _) in enumerate(cameras):
                raws[number, rows] = _raw(model, view, rows)
            weights[:, rows] = _shares(
                np.stack(
                    [
                        _weight(raw[rows], size_raw, region, view, rows)
                        for raw, (_, size_raw, region) in zip(raws, cameras, strict=True)
                    ]
                )
            )
        unseen = ~np.any(weights, axis=0)
        background = np.full((size.height, size.width, 3), BORDER_BGR, np.uint8)
        hatched = np.add.outer(np.arange(size.height), np.arange(size.width)) % HATCH_PX < 2
        background[unseen & hatched] = HATCH_BGR
        seam = np.flatnonzero(np.count_nonzero(weights, axis=0) > 1)
        parts = tuple(
            _part(raw, weight, seam, size_raw)
            for raw, weight, (_, size_raw, _) in zip(raws, weights, cameras, strict=True)
        )
        return cls(
            view,
            parts,
            seam,
            background,
            unseen,
            tuple(float(w.mean(dtype=float)) for w in weights),
        )

    @property
    def nbytes(self) -> int:
        """What it keeps in memory, about; with the maps that are made when it first stitches."""
        parts = [part for part in self.parts if part is not None]
        kept = [
            array for p in parts for array in (p.map.raw_x, p.map.raw_y, p.alone, p.seam, p.weight)
        ]
        return sum(
            array.nbytes for array in (*kept, self.seam, self.background, self.unseen)
        ) + sum(6 * p.alone.size for p in parts)

    def stitch(self, pictures: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
        """(h, w, 3) BGR, of one raw picture for each camera."""
        out = self.background.copy()
        blended = np.zeros((len(self.seam), 3), np.float32)
        for part, pixels in zip(self.parts, pictures, strict=True):
            if part is None:
                continue
            if ImageSize(pixels.shape[1], pixels.shape[0]) != part.size:
                raise BadInput(
                    "The size of an image differs from the calibration of its camera.",
                    "Use images of the calibrated size.",
                    reason="size-mismatch",
                )
            corrected = part.map.apply(pixels)
            cv2.copyTo(corrected, part.alone, out[part.window])
            if len(self.seam):
                blended += cv2.multiply(
                    _whole(corrected).take(part.seam).view(np.uint8).reshape(-1, 3),
                    part.weight,
                    dtype=cv2.CV_32F,
                )
        if len(self.seam):
            np.put(
                _whole(out), self.seam, _whole(np.asarray(cv2.convertScaleAbs(blended), np.uint8))
            )
        return out

    def description(self, cameras: Sequence[str]) -> StitchedView:
        """Describe the picture; cameras: by name, in the order of the parts."""
        view = self.view
        return {
            "width": view.size.width,
            "height": view.size.height,
            "px_per_mm": view.px_per_mm,
            "corner": view.field_from_view_corner(),
            "overlay": view.overlay(),
            "unseen": self.unseen_summary(),
            "cameras": [
                {"camera": camera, "share": share}
                for camera, share in zip(cameras, self.shown_share, strict=True)
            ],
        }

    def unseen_summary(self) -> Unseen:
        """Return which part of the field no camera sees, without the margin."""
        size, field = self.view.size, self.view.field
        at = self.view.field_from_view(
            np.stack(np.meshgrid(np.arange(size.width), np.arange(size.height)), axis=-1).astype(
                float
            )
        )
        on_field = (np.abs(at[..., 0]) <= field.length_mm / 2) & (
            np.abs(at[..., 1]) <= field.width_mm / 2
        )
        unseen = self.unseen & on_field
        share = float(unseen.sum() / max(on_field.sum(), 1))
        where: Range | None = None
        if unseen.any():
            x, y = at[unseen].T
            where = {"x": [float(x.min()), float(x.max())], "y": [float(y.min()), float(y.max())]}
        area = share * field.length_mm * field.width_mm / 1e6
        words = (
            "The whole field is covered."
            if where is None
            else f"{area:.2g} m² ({100 * share:.2g} %) of the field is not covered by any camera, within x "
            f"{where['x'][0]:.0f} to {where['x'][1]:.0f} mm and y {where['y'][0]:.0f} to {where['y'][1]:.0f} mm."
        )
        return {"share": share, "m2": area, "where": where, "words": words}


def _whole(pixels: NDArray[np.uint8]) -> NDArray[np.void]:
    """The same pixels (…, 3) in a row, each as one thing that is moved at once: four times as quick as by channels."""
    return pixels.reshape(-1, 3).view(np.dtype("V3")).ravel()


def _raw(model: CameraModel, view: FieldView, rows: slice) -> Points:
    x, y = np.arange(view.size.width, dtype=float), np.arange(rows.start, rows.stop, dtype=float)
    return raw_from_field(model, view.field_from_view(np.stack(np.meshgrid(x, y), axis=-1)))


def _weight(
    raw: NDArray[np.float32], size: ImageSize, region: Region, view: FieldView, rows: slice
) -> Array:
    """0 where the camera shows nothing, 1 well inside its picture and its region."""
    with np.errstate(invalid="ignore"):
        edge = np.minimum(raw, np.array(tuple(size)) - 1 - raw).min(axis=-1)
        ramp = np.where(
            inside_picture(raw, size), np.clip((edge + 1) / FEATHER_PX, FILL_WEIGHT, 1), 0
        )
    x = view.field_from_view(np.arange(view.size.width)[:, None] * [1.0, 0.0])[:, 0]
    y = view.field_from_view(np.arange(rows.start, rows.stop)[:, None] * [0.0, 1.0])[:, 1]
    into = np.minimum(
        _into(x, region.x_mm, view.field.length_mm)[None],
        _into(y, region.y_mm, view.field.width_mm)[:, None],
    )
    return ramp * np.clip((into + FEATHER_MM) / (2 * FEATHER_MM), FILL_WEIGHT, 1)


def _shares(weights: Array) -> Array:
    """Each camera's share of each pixel, one in all where any shows it; what is next to nothing or all is that."""
    total = weights.sum(axis=0)
    shares = weights / np.where(total > 0, total, 1)
    shares[shares > FULL_WEIGHT] = 1
    shares[shares < 1 - FULL_WEIGHT] = 0
    total = shares.sum(axis=0)
    return shares / np.where(total > 0, total, 1)


def _into(at: NDArray, span: tuple[float, float], side_mm: float) -> NDArray:
    """How far within the span, mm; a span that ends with the field goes on beyond it."""
    low = np.where(span[0] <= -side_mm / 2 + 1, np.inf, at - span[0])
    high = np.where(span[1] >= side_mm / 2 - 1, np.inf, span[1] - at)
    return np.minimum(low, high)


def _part(
    raw: NDArray[np.float32], weight: NDArray[np.float32], seam: NDArray[np.int64], size: ImageSize
) -> MosaicTile | None:
    shown = weight > 0
    if not shown.any():
        return None
    rows, columns = (np.flatnonzero(shown.any(axis=axis)) for axis in (1, 0))
    window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    maps = CorrectionMap(*(np.ascontiguousarray(raw[window][..., axis]) for axis in (0, 1)))
    alone = np.where(weight[window] == 1, 255, 0).astype(np.uint8)
    of_seam = weight.ravel()[seam]
    row, column = np.divmod(seam, weight.shape[1])
    here = (row - rows[0]) * alone.shape[1] + column - columns[0]
    return MosaicTile(
        window,
        maps,
        alone,
        np.where(of_seam > 0, here, 0),
        np.repeat(of_seam[:, None], 3, axis=1),
        size,
    )


def stitcher_of(
    rig: Rig, names: Container[str], view: FieldView, progress: Progress = no_progress
) -> tuple[Stitcher, list[str]]:
    """For those of a rig's cameras that are calibrated on its field; and which these are."""
    cameras, shown = [], []
    for camera in rig.cameras:
        calibration = camera.calibration
        if (
            camera.camera in names
            and calibration is not None
            and calibration.field["name"] == view.field.name
        ):
            region = view.field.region(camera.region or calibration.region)
            cameras.append((model_of(calibration), calibration.image_size, region))
            shown.append(camera.camera)
    return Stitcher.of(cameras, view, progress), shown
