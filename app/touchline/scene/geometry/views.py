"""Viewpoints: straight above, through a camera, or freely from beside the field."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Field
from touchline.scene.geometry.boards import BoardViews
from touchline.scene.geometry.frustum import Frustum

FOV_RAD = float(np.radians(50))  # from top to bottom: about what an eye takes in of a screen
WIDE = 1.2  # width over height of a window that shows all from as near as that
MARGIN = 1.12  # of the field's extent


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """position_mm, look_at_mm, up (3,), field frame; fov_rad from top to bottom of the window."""

    position_mm: NDArray[np.float64]
    look_at_mm: NDArray[np.float64]
    up: NDArray[np.float64]
    fov_rad: float = FOV_RAD

    @classmethod
    def above(cls, field: Field, aspect: float) -> Self:
        """The whole field, x to the right and y up. aspect: of the window, width over height."""
        half = max(field.length_mm / aspect, field.width_mm) / 2 * MARGIN
        return cls(np.array([0.0, 0.0, half / np.tan(FOV_RAD / 2)]), np.zeros(3), np.array([0.0, 1.0, 0.0]))

    @classmethod
    def free(cls, field: Field, highest_mm: float, aspect: float) -> Self:
        """From beside the field, so that cameras of that height are seen as well."""
        reach = max(field.length_mm, field.width_mm, 1.6 * highest_mm) * max(1.0, WIDE / aspect)
        return cls(np.array([0.25 * reach, -1.05 * reach, 0.75 * reach]), np.array([0.0, 0.0, 0.3 * highest_mm]),
                   np.array([0.0, 0.0, 1.0]))

    @classmethod
    def through(cls, frustum: Frustum, aspect: float) -> Self:
        """From the camera's position along its axis, with its whole picture in the window."""
        return cls(frustum.position_mm, frustum.ahead, -frustum.field_from_camera[:, 1], frustum.fov_within(aspect))

    @classmethod
    def beside(cls, boards: BoardViews) -> Self:
        """A camera that looks along z with y down, and the boards before it."""
        far = float(boards.quads[..., 2].max())
        return cls(np.array([0.8 * far, -0.5 * far, -0.5 * far]), np.array([0.0, 0.0, 0.5 * far]),
                   np.array([0.0, -1.0, 0.0]))
