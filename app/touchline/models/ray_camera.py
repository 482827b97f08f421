"""Cameras with rays: a centre of projection, a pose, a focal length, and a lens of any kind in between.

    ray = R (field - position)                      field mm, R = camera_from_field
    pixel = centre + focal · (1, aspect) · distort(ray)

The corrected frame is the region seen straight from above: the same rectangle as the paper's method makes, so that
models can be compared and the cameras of a rig agree. Each camera with a lens is a ray camera behind one of lenses/.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import (
    MAX_COORDINATE,
    Array,
    ImageSize,
    Mask,
    Points,
    as_triple,
    unreachable_where,
    with_z,
)
from touchline.core.quarter_turn import QuarterTurn
from touchline.core.statements import named
from touchline.models import MODELS
from touchline.models.contract import EXPORTED, RayModel, TopView, read_model
from touchline.models.lenses import Lens
from touchline.models.lenses.brown_conrady import BrownConradyLens
from touchline.models.lenses.division import DivisionLens
from touchline.models.lenses.kannala_brandt import KannalaBrandtLens
from touchline.models.lenses.ssl import SslLens
from touchline.models.rotation import matrix_from_vector, vector_from_matrix

REACH = 1.0  # how far beyond the picture a lens is extrapolated, as a share of the picture's extent


@dataclass(frozen=True)
class RayCamera(TopView, RayModel):
    """What all cameras with a lens have in common; a subclass names its LENS.

    focal_px: in x; y has focal_px · aspect. centre_px: principal point. rotation: camera_from_field as a rotation
    vector (Rodrigues). position_mm: the centre of projection in the field frame; z is the height above the carpet.
    width_px, height_px: I_width and I_height of the corrected rectangle.
    """

    LENS: ClassVar[type[Lens]]

    lens_terms: tuple[float, ...]
    focal_px: float
    aspect: float
    centre_px: tuple[float, float]
    rotation: tuple[float, float, float]
    position_mm: tuple[float, float, float]
    width_px: float
    height_px: float
    n_rectangles_x: int
    n_rectangles_y: int
    region: Region
    image_size: ImageSize

    @cached_property
    def camera_from_field(self) -> Array:
        return matrix_from_vector(np.array(self.rotation))

    @cached_property
    def _terms(self) -> Array:
        return np.array(self.lens_terms)

    def project(self, points_field_xyz: Array) -> Points:
        """Map field mm (..., 3) to raw pixels; NaN behind the camera, past the horizon, or far outside the picture."""
        with np.errstate(all="ignore"):
            rays = (
                np.asarray(points_field_xyz, float) - np.array(self.position_mm)
            ) @ self.camera_from_field.T
            pixels = self.pixels_from_rays(rays)
            near = np.all(np.abs(points_field_xyz) < MAX_COORDINATE, axis=-1)
        return unreachable_where(~near | self._beyond(pixels), pixels)

    def unproject(self, pixels: Points, z_mm: float | Array = 0.0) -> Points:
        """Map raw pixels to field mm (..., 2) in the plane at z_mm; NaN where the ray does not meet it ahead."""
        with np.errstate(all="ignore"):
            rays = self.rays(pixels) @ self.camera_from_field
            x, y, z = self.position_mm
            reach = (z_mm - z) / rays[..., 2]
            field = np.array([x, y]) + rays[..., :2] * reach[..., None]
            far = ~np.all(np.abs(field) < MAX_COORDINATE, axis=-1)
            return unreachable_where(
                ~(reach > 0) | far | self._beyond(np.asarray(pixels, float)), field
            )

    def rays(self, pixels: Points) -> Array:
        """Map raw pixels (..., 2) to rays (..., 3) in the camera's frame; NaN beyond the lens's horizon."""
        with np.errstate(all="ignore"):
            about = np.asarray(pixels, float) - np.array(self.centre_px)
            return self.LENS.undistort(
                self._terms, about / (self.focal_px * np.array([1, self.aspect]))
            )

    def pixels_from_rays(self, rays: Array) -> Points:
        """Map rays (..., 3) in the camera's frame to raw pixels (..., 2); NaN behind it and beyond the horizon."""
        with np.errstate(all="ignore"):
            plane = self.LENS.distort(self._terms, rays)
            return plane * (self.focal_px * np.array([1, self.aspect])) + np.array(self.centre_px)

    def _beyond(self, pixels: Points) -> Mask:
        """Return where pixels are further than REACH outside the picture, or not numbers."""
        extent = (0.5 + REACH) * np.array(tuple(self.image_size), float)
        return ~np.all(np.abs(pixels - np.array(self.image_size.centre)) <= extent, axis=-1)

    def corrected_from_raw(self, points: Points) -> Points:
        return self.corrected_from_field(self.unproject(points))

    def raw_from_corrected(self, points: Points) -> Points:
        return self.project(with_z(self.field_from_corrected(points)))

    def turned(self, turn_deg: int) -> Self:
        """Turn lens, centre and camera about the optical axis: plane' = R plane, ray' = R ray, position as it was."""
        turn = QuarterTurn(turn_deg, self.image_size)
        focal_px, aspect, centre_px = turn.pinhole(self.focal_px, self.aspect, self.centre_px)
        return replace(
            self,
            lens_terms=tuple(map(float, self.LENS.turned(self._terms, turn.matrix))),
            focal_px=focal_px,
            aspect=aspect,
            centre_px=centre_px,
            rotation=as_triple(vector_from_matrix(turn.about_axis @ self.camera_from_field)),
            image_size=turn.size_after,
        )

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        model = read_model(cls, parameters)
        if not model.plausible():
            raise BadInput(
                "These parameters do not describe a camera over a field.",
                EXPORTED,
                reason="bad-parameters",
            )
        return model

    def plausible(self) -> bool:
        """Return whether this can be a camera above a field: finite, above the carpet, with a usual focal length."""
        numbers = [
            *self.lens_terms,
            self.focal_px,
            self.aspect,
            *self.centre_px,
            *self.rotation,
            *self.position_mm,
        ]
        width = self.image_size.width
        return bool(
            len(self.lens_terms) == len(self.LENS.TERMS)
            and np.isfinite(numbers).all()
            and np.abs(numbers).max() < MAX_COORDINATE
            and 0.05 * width <= self.focal_px <= 100 * width
            and 0.5 <= self.aspect <= 2
            and self.position_mm[2] > 0
            and np.linalg.norm(self.rotation) < 10
        )


def lens_model(name: str) -> type[RayCamera]:
    """Return the model of that name in MODELS; BadInput for one without a lens."""
    model = MODELS[name]
    if not issubclass(model, RayCamera):
        raise BadInput(
            f"The model {name} has no lens.", "Use a physical lens model.", reason="bad-parameters"
        )
    return model


@dataclass(frozen=True)
class Division(RayCamera):
    """A pinhole behind the division lens."""

    NAME: ClassVar[str] = "division"
    TITLE: ClassVar[str] = named("model.division", "Division")
    HELP: ClassVar[str] = (
        "A pinhole with one distortion parameter: requires the fewest points of all models with "
        "distortion."
    )
    LENS: ClassVar[type[Lens]] = DivisionLens


@dataclass(frozen=True)
class BrownConrady(RayCamera):
    """A pinhole behind Brown and Conrady's lens, as OpenCV has it."""

    NAME: ClassVar[str] = "brown-conrady"
    TITLE: ClassVar[str] = named("model.brown-conrady", "Brown–Conrady")
    HELP: ClassVar[str] = (
        "A pinhole with radial and tangential distortion: suitable for nearly every field camera."
    )
    LENS: ClassVar[type[Lens]] = BrownConradyLens


@dataclass(frozen=True)
class Fisheye(RayCamera):
    """A fisheye behind Kannala and Brandt's lens."""

    NAME: ClassVar[str] = "fisheye"
    TITLE: ClassVar[str] = named("model.fisheye", "Fisheye (Kannala–Brandt)")
    HELP: ClassVar[str] = (
        "For very wide lenses that show straight lines as arcs. Requires points out to the edge of "
        "the image."
    )
    LENS: ClassVar[type[Lens]] = KannalaBrandtLens


@dataclass(frozen=True)
class Ssl(RayCamera):
    """A pinhole behind the lens of the league's geometry messages."""

    NAME: ClassVar[str] = "ssl"
    TITLE: ClassVar[str] = named("model.ssl", "SSL")
    HELP: ClassVar[str] = (
        "The one-parameter lens of the Small Size League: choose it when SSL-Vision must use the "
        "result."
    )
    LENS: ClassVar[type[Lens]] = SslLens
