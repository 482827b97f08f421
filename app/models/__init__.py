"""What a camera model is, and the table of those there are.

A model is a frozen dataclass whose fields are its parameters (asdict() is its JSON). It maps between four
frames (geometry.py) and can be fitted to observations. To add one: write app/models/NAME.py with a class
that follows CameraModel, add its line to MODELS; the laws in tests/unit/models/test_models.py then hold for it.

Laws, for every example of every model: there and back is the same pixel; the shape of the points is kept;
a point out of reach is NaN; parameters survive JSON exactly; a fit on its own exact points returns itself;
too few points say how many are needed; a scaled image gives the scaled model.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from app.core.field import Field, Region
from app.core.geometry import ImageSize, Points
from app.core.options import Option, read_options
from app.core.records import Fit, Observations
from app.core.registry import Registry

__all__ = ["MODELS", "CameraModel", "Option", "Progress", "field_from_raw", "model_from_json", "no_progress",
           "parameters_json", "raw_from_field", "read_options"]

Progress = Callable[[float, str], None]


def no_progress(fraction: float, message: str) -> None:
    """For callers who do not watch."""


@runtime_checkable
class CameraModel(Protocol):
    """What every model can do. Points are (..., 2) and keep their shape; out of reach is NaN."""

    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    HELP: ClassVar[str]
    OPTIONS: ClassVar[tuple[Option, ...]]
    NEEDS_EVERY_BORDER: ClassVar[bool]  # made of borders: none of them can be left out to check it

    @property
    def corrected_size(self) -> ImageSize: ...
    def corrected_from_raw(self, points: Points) -> Points: ...
    def raw_from_corrected(self, points: Points) -> Points: ...
    def field_from_corrected(self, points: Points) -> Points: ...
    def corrected_from_field(self, points: Points) -> Points: ...

    @classmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Find the parameters; FitFailed says what is missing. Numbers in, numbers out."""

    @classmethod
    def points_needed(cls, options: Mapping[str, Any] | None = None) -> str:
        """How few points do, in a sentence."""

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Self:
        """Read what asdict() wrote; refuse anything else."""

    @classmethod
    def examples(cls) -> Iterable[Self]:
        """A few real cameras, for tests, benchmarks and the manual."""


MODELS = Registry("camera model", {
    "polynomial": "app.models.polynomial:Polynomial",  # the paper's: two one-dimensional corrections from four borders
    "homography": "app.models.homography:Homography",  # no lens at all: eight numbers from four lines
    "thin-plate": "app.models.thin_plate:ThinPlate",  # bends away what another model leaves, without a reason
    "division": "app.models.division:Division",  # a pinhole with one distortion number
    "brown-conrady": "app.models.brown_conrady:BrownConrady",  # radial and tangential terms: nearly every field camera
    "fisheye": "app.models.fisheye:Fisheye",  # Kannala–Brandt, for very wide lenses
    "ssl": "app.models.ssl:Ssl",  # the league's one term, for its software
})


def field_from_raw(model: CameraModel, points: Points) -> Points:
    """Raw pixels to field mm on the carpet."""
    return model.field_from_corrected(model.corrected_from_raw(points))


def raw_from_field(model: CameraModel, points: Points) -> Points:
    """Field mm on the carpet to raw pixels."""
    return model.raw_from_corrected(model.corrected_from_field(points))


def model_from_json(name: str, parameters: Mapping[str, Any]) -> CameraModel:
    return MODELS[name].from_parameters(parameters)


def parameters_json(model: CameraModel) -> dict[str, Any]:
    """asdict, with tuples as lists: what json.loads would give back."""
    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value
    return plain(asdict(model))
