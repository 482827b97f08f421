"""What a camera model is, and the table of those there are.

A model is a frozen dataclass whose fields are its parameters (asdict() is its JSON). It maps between four
frames (geometry.py) and can be fitted to observations. To add one: write app/models/NAME.py with a class
that follows CameraModel, add its line to MODELS; the laws in tests/test_models.py then hold for it.

Laws, for every example of every model: there and back is the same pixel; the shape of the points is kept;
a point out of reach is NaN; parameters survive JSON exactly; a fit on its own exact points returns itself;
too few points say how many are needed; a scaled image gives the scaled model.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from app.errors import BadInput
from app.field import Field, Region
from app.geometry import ImageSize, Points
from app.records import Fit, Observations
from app.registry import Registry

Progress = Callable[[float, str], None]


def no_progress(fraction: float, message: str) -> None:
    """For callers who do not watch."""


@dataclass(frozen=True)
class Option:
    """One setting of a fit, described well enough to build a form from it."""

    name: str
    type: str  # "int", "float", "bool", "choice", "int-or-auto"
    default: Any
    help: str
    range: tuple[float, float] | None = None
    unit: str | None = None
    choices: tuple[str, ...] = ()

    def read(self, value: Any) -> Any:
        """The value, checked; BadInput says what is allowed."""
        if value is None:
            return self.default
        if self.type == "choice":
            if value in self.choices:
                return value
            raise self._refuse(value, " or ".join(repr(c) for c in self.choices))
        if self.type == "terms-or-auto":
            if value == "auto":
                return value
            if isinstance(value, (list, tuple)) and all(v in self.choices for v in value):
                return tuple(c for c in self.choices if c in value)
            raise self._refuse(value, f'"auto", or a list out of {", ".join(self.choices)}')
        if self.type == "value-and-sigma":
            return self._read_value_and_sigma(value)
        if self.type == "calibration":
            if isinstance(value, Mapping) and "name" in value \
                    and (isinstance(value.get("parameters"), Mapping) or isinstance(value.get("lens"), Mapping)):
                return value
            raise self._refuse(value, "the id of a calibration")
        if self.type == "bool":
            if isinstance(value, bool):
                return value
            raise self._refuse(value, "true or false")
        if self.type == "int-or-auto" and value == "auto":
            return value
        allowed = f"a number from {self.range[0]:g} to {self.range[1]:g}" if self.range else "a number"
        if self.type == "int-or-auto":
            allowed += ', or "auto"'
        if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value:
            raise self._refuse(value, allowed)
        if self.range and not self.range[0] <= value <= self.range[1]:
            raise self._refuse(value, allowed)
        if self.type.startswith("int"):
            if value != int(value):
                raise self._refuse(value, "a whole number, " + allowed)
            return int(value)
        return float(value)

    def _read_value_and_sigma(self, value: Any) -> dict[str, float]:
        allowed = f'{{"value": {self.range[0]:g} to {self.range[1]:g}, "sigma": 0.1 to 5000}} in {self.unit}'
        if not isinstance(value, Mapping) or set(value) != {"value", "sigma"}:
            raise self._refuse(value, allowed)
        for number, (low, high) in ((value["value"], self.range), (value["sigma"], (0.1, 5000))):
            if isinstance(number, bool) or not isinstance(number, (int, float)) or not low <= number <= high:
                raise self._refuse(value, allowed)
        return {"value": float(value["value"]), "sigma": float(value["sigma"])}

    def _refuse(self, value: Any, allowed: str) -> BadInput:
        return BadInput(f"The option {self.name} cannot be {value!r}.", f"Use {allowed}.", reason="bad-option")

    def to_json(self) -> dict[str, Any]:
        return {"name": self.name, "type": self.type, "default": self.default, "help": self.help,
                "range": list(self.range) if self.range else None, "unit": self.unit, "choices": list(self.choices)}


def read_options(described: Iterable[Option], given: Mapping[str, Any] | None) -> dict[str, Any]:
    """Every described option with its given or default value; an unknown one is refused by name."""
    table = {option.name: option for option in described}
    given = given or {}
    for name in given:
        if name not in table:
            raise BadInput(f"There is no option called {name!r} here.", f"Use one of: {', '.join(table)}.",
                           reason="unknown-option")
    return {name: option.read(given.get(name)) for name, option in table.items()}


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
