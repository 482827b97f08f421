"""The contract of a fitter: how the parameters of one camera model are found, and how far they move what it sees."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize, Points
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option
from touchline.core.records import Fit, Observations
from touchline.models import CameraModel


class Sensitivity(Protocol):
    """How one camera's view moves with its parameters: what expected error and the next best click are made of.

    names: parameters that a covariance of this model may have, as in Fit.parameter_names; lines' own offsets come
    beside them and move nothing.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    def field_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> Array:
        """Differentiate the place where a pixel's ray meets the plane by named parameters: (n, 2, len(names)) mm.

        points_field_xyz (n, 3): the places. NaN where the camera does not see the place, or sees the plane edge-on.
        """

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        """Differentiate a click's distance from a curve by named parameters: (n, len(names)) px.

        The curve passes places (n, 2) mm in the directions along (n, 2).
        """


class Fitter(ABC):
    """Finds the parameters of one camera model from observations; a class without state."""

    MODEL: ClassVar[type[CameraModel]]
    OPTIONS: ClassVar[tuple[Option, ...]]
    NEEDS_EVERY_BORDER: ClassVar[bool] = False  # made of borders: none of them can be left out to check it

    @classmethod
    @abstractmethod
    def points_needed(cls) -> str:
        """Say in a sentence how few points do."""

    @classmethod
    @abstractmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Find the parameters; FitFailed says what is missing."""

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        """Return how the model's view moves with its parameters; None where it has no common parameters."""
        return None
