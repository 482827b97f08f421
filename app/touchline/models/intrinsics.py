"""A camera's intrinsics with their covariance, without a pose, and how two lenses differ over the picture.

To compare two lenses, a pixel goes out through the first lens as a ray, is turned by the one rotation that brings both
lenses closest over the whole picture, and comes back through the second. (The same measure as D. Kogan's mrcal uses,
for far points.)
"""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.geometry import (
    MAX_COORDINATE,
    Array,
    ImageSize,
    Points,
    homogeneous,
    unreachable_where,
)
from touchline.core.json_values import read
from touchline.core.quarter_turn import QuarterTurn
from touchline.models import parameters_json
from touchline.models.lenses import Lens
from touchline.models.ray_camera import lens_model
from touchline.models.rotation import matrix_from_vector
from touchline.models.turned_covariance import turned_covariance

RETURNED = "Send the lens that a board calibration returned."
# the names before those of the lens's own terms
PINHOLE_PARAMETERS = ("log_focal", "aspect", "centre_x", "centre_y")

GRID = (24, 18)
HALF_DIAGONAL = 33  # places along it
TURN_STEPS = 8
STEP_RAD = 1e-6


@dataclass(frozen=True)
class Intrinsics:
    """pixel = centre + focal · (1, aspect) · distort(ray).

    model: the camera model whose lens it is, a name in MODELS. terms: all of that lens's, in its order.
    estimated: names of what was estimated (out of HELD and the lens's terms); covariance: theirs, n × n, in the units
    of the parameters (the focal length as its logarithm). What is not named was held fast.
    """

    model: str
    terms: tuple[float, ...]
    focal_px: float
    aspect: float
    centre_px: tuple[float, float]
    image_size: ImageSize
    estimated: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()

    @property
    def lens(self) -> type[Lens]:
        return lens_model(self.model).LENS

    @property
    def values(self) -> dict[str, float]:
        """Return every parameter by name, in the covariance's units."""
        return {
            "log_focal": float(np.log(self.focal_px)),
            "aspect": self.aspect,
            "centre_x": self.centre_px[0],
            "centre_y": self.centre_px[1],
            **dict(zip(self.lens.TERMS, self.terms, strict=True)),
        }

    @property
    def sigma(self) -> dict[str, float]:
        """Return σ of each estimated parameter."""
        return {
            name: float(np.sqrt(max(self.covariance[i][i], 0.0)))
            for i, name in enumerate(self.estimated)
        }

    def project(self, rays: Array) -> Points:
        """Map rays (…, 3) in the camera's frame to raw pixels (…, 2); NaN beyond the lens's horizon."""
        with np.errstate(all="ignore"):
            pixels = self.lens.distort(
                np.array(self.terms), np.asarray(rays, float)
            ) * self._focal + np.array(self.centre_px)
            return unreachable_where(~(np.abs(pixels) < MAX_COORDINATE).all(axis=-1), pixels)

    def rays(self, pixels: Points) -> Array:
        """Map raw pixels (…, 2) to rays (…, 3) of unit length; NaN beyond the lens's horizon."""
        with np.errstate(all="ignore"):
            rays = self.lens.undistort(
                np.array(self.terms),
                (np.asarray(pixels, float) - np.array(self.centre_px)) / self._focal,
            )
            return rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def undistorted_from_raw(self, raw: Points) -> Points:
        """Map raw pixels (…, 2) to those of a pinhole with the same focal length; NaN from 90° off the axis on."""
        rays = self.rays(raw)
        with np.errstate(all="ignore"):
            plane = rays[..., :2] / rays[..., 2:]
            return unreachable_where(~(rays[..., 2] > 0), plane * self._focal + self.centre_px)

    def raw_from_undistorted(self, straight: Points) -> Points:
        """Map a pinhole's pixels (…, 2) to raw ones; NaN beyond the lens's horizon."""
        return self.project(homogeneous((straight - np.array(self.centre_px)) / self._focal))

    def scaled_to(self, width: int) -> Self:
        """Return the lens for images of this width and the same shape, as if they were scaled."""
        s = width / self.image_size.width
        x, y = (s * (at + 0.5) - 0.5 for at in self.centre_px)
        size = ImageSize(width, round(s * self.image_size.height))
        return replace(self, focal_px=self.focal_px * s, centre_px=(x, y), image_size=size)

    @property
    def view_deg(self) -> float:
        """Return the angle of view from corner to corner, or between the last rays that the lens has on the way."""
        corner = np.array([self.image_size.width, self.image_size.height]) - 0.5
        share = np.linspace(-1, 1, 2 * HALF_DIAGONAL - 1)[:, None]
        middle, half = (corner - 0.5) / 2, (corner + 0.5) / 2
        rays = self.rays(np.stack([middle + share * half, middle + share * half * (1, -1)]))
        angles = np.nan_to_num(np.arctan2(np.linalg.norm(rays[..., :2], axis=-1), rays[..., 2]))
        halves = angles[:, :HALF_DIAGONAL].max(axis=1) + angles[:, HALF_DIAGONAL - 1 :].max(axis=1)
        return float(np.degrees(halves.max()))

    @property
    def _focal(self) -> Array:
        return self.focal_px * np.array([1.0, self.aspect])

    def turned(self, turn_deg: int) -> Self:
        """Return the same lens for its picture turned clockwise, with what is known of it; exact."""
        turn = QuarterTurn(turn_deg, self.image_size)
        names, covariance = turned_covariance(
            self.estimated, np.array(self.covariance), turn, self.lens.VECTORS, self.aspect
        )
        return type(self)(
            self.model,
            tuple(map(float, self.lens.turned(np.array(self.terms), turn.matrix))),
            *turn.pinhole(self.focal_px, self.aspect, self.centre_px),
            turn.size_after,
            names,
            tuple(tuple(map(float, row)) for row in covariance),
        )

    def to_json(self) -> dict[str, Any]:
        return parameters_json(self)

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        lens = read(cls, value, "The lens", RETURNED, "bad-parameters")
        ImageSize.of(lens.image_size)
        lens._refuse_nonsense()
        return lens

    def _refuse_nonsense(self) -> None:
        numbers = np.array([*self.terms, self.focal_px, self.aspect, *self.centre_px])
        n = len(self.estimated)
        fine = (
            len(self.terms) == len(self.lens.TERMS)
            and np.isfinite(numbers).all()
            and np.abs(numbers).max() < MAX_COORDINATE
            and 0.05 * self.image_size.width <= self.focal_px <= 100 * self.image_size.width
            and 0.5 <= self.aspect <= 2
            and len(set(self.estimated)) == n
            and set(self.estimated) <= {*PINHOLE_PARAMETERS, *self.lens.TERMS}
            and len(self.covariance) == n
            and all(len(row) == n for row in self.covariance)
        )
        if fine and n:
            c = np.array(self.covariance)
            fine = bool(
                np.isfinite(c).all()
                and np.allclose(c, c.T, rtol=1e-6, atol=0)
                and (np.diag(c) >= 0).all()
            )
        if not fine:
            raise BadInput(
                "These parameters do not describe a lens.", RETURNED, reason="bad-parameters"
            )


def picture_grid(size: ImageSize, columns: int = GRID[0], rows: int = GRID[1]) -> Array:
    """(rows, columns, 2) px, the middles of equal cells."""
    x = (np.arange(columns) + 0.5) * size.width / columns - 0.5
    y = (np.arange(rows) + 0.5) * size.height / rows - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1)


def lens_difference(first: Intrinsics, second: Intrinsics, pixels: Array | None = None) -> Array:
    """Vectors (…, 2) px at the given pixels of the first, or its grid; NaN where either lens sees nothing."""
    pixels = picture_grid(first.image_size) if pixels is None else pixels
    rays = first.rays(pixels)
    rotation = np.eye(3)
    for _ in range(TURN_STEPS):
        projected = second.project(rays @ rotation.T)
        fine = np.isfinite(projected).all(axis=-1)
        if fine.sum() < 3:
            break
        by = np.stack(
            [
                (second.project(rays @ (turn @ rotation).T) - projected)[fine].ravel() / STEP_RAD
                for turn in matrix_from_vector(np.eye(3) * STEP_RAD)
            ],
            axis=1,
        )
        error = (projected - pixels)[fine].ravel()
        known = np.isfinite(by).all(axis=1)
        step = np.linalg.lstsq(by[known], -error[known], rcond=None)[0]
        rotation = matrix_from_vector(np.clip(step, -0.5, 0.5)) @ rotation
        if np.linalg.norm(step) < 1e-12:
            break
    return second.project(rays @ rotation.T) - pixels
