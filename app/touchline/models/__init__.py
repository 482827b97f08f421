"""Camera models: how a camera maps points, the table of those there are, and what a stored calibration describes.

A model is a frozen dataclass whose fields are its parameters. It maps between the four frames of core/geometry.py and
knows nothing of how it is fitted: that is touchline/fitting, which has a fitter of the same name for each that
is still fitted.

To add one: write models/NAME.py with a class that follows contract.CameraModel (for a camera with rays, a subclass
of RayCamera in ray_camera.py that names its lens from lenses/), add its line to MODELS and a fitter to fitting/.
The laws in tests/unit/models/test_models.py then hold for it.

Laws, for every example of every model: there and back is the same pixel; the shape of the points is kept;
a point out of reach is NaN; parameters survive JSON exactly; a fit on its own exact points returns itself;
too few points say how many are needed; a scaled image gives the scaled model; a turned pixel of the turned model is
the same place.
"""

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, NamedTuple, Self

from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Points
from touchline.core.records import Calibration
from touchline.core.registry import Registry
from touchline.models.contract import CameraModel, RayModel

__all__ = [
    "MODELS",
    "CameraModel",
    "RayModel",
    "Restored",
    "field_from_raw",
    "model_from_json",
    "model_of",
    "parameters_json",
    "raw_from_field",
]

MODELS: Registry[type[CameraModel]] = Registry(
    "camera model",
    {
        # the paper's: two 1-D corrections from four borders
        "polynomial": "touchline.models.polynomial:Polynomial",
        # no lens at all: eight numbers from four lines
        "homography": "touchline.models.homography:Homography",
        # of earlier versions, read and no longer fitted
        "thin-plate": "touchline.models.thin_plate:ThinPlate",
        "division": "touchline.models.ray_camera:Division",  # a pinhole with one distortion number
        # radial and tangential: nearly every field camera
        "brown-conrady": "touchline.models.ray_camera:BrownConrady",
        "fisheye": "touchline.models.ray_camera:Fisheye",  # Kannala–Brandt, for very wide lenses
        "ssl": "touchline.models.ray_camera:Ssl",  # the league's one term, for its software
    },
)


def field_from_raw(model: CameraModel, points: Points) -> Points:
    """Map raw pixels to field mm on the carpet."""
    return model.field_from_corrected(model.corrected_from_raw(points))


def raw_from_field(model: CameraModel, points: Points) -> Points:
    """Map field mm on the carpet to raw pixels."""
    return model.raw_from_corrected(model.corrected_from_field(points))


def model_from_json(name: str, parameters: Mapping[str, Any]) -> CameraModel:
    """Return the model of that name with these parameters."""
    return MODELS[name].from_parameters(parameters)


def parameters_json(model: Any) -> dict[str, Any]:
    """Return asdict() with lists for tuples: what json.loads would give back.

    Without what says nothing and came later: keyword-only parameters at their default, which older versions refuse.
    """

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value

    later = {f.name for f in fields(model) if f.kw_only and getattr(model, f.name) == f.default}
    return plain({name: value for name, value in asdict(model).items() if name not in later})


def model_of(calibration: Calibration) -> CameraModel:
    """Return the calibration's camera model."""
    return model_from_json(calibration.model_name, calibration.model_parameters)


class Restored(NamedTuple):
    """A calibration's objects, as its record describes them."""

    model: CameraModel
    field: Field
    region: Region

    @classmethod
    def of(cls, calibration: Calibration) -> Self:
        """Read them from the record; the field's lines lie where the fit found them."""
        field = field_from_json(calibration.field)
        region = field.region(calibration.region, calibration.rotate)
        return cls(model_of(calibration), field.as_painted(calibration.report, region), region)
