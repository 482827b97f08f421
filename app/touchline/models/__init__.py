"""Camera models: how a camera maps points, and the table of those there are.

A model is a frozen dataclass whose fields are its parameters. It maps between the four frames of core/geometry.py and
knows nothing of how it is fitted: that is touchline/fitting, which has a fitter of the same name for each that
is still fitted.

To add one: write models/NAME.py with a class that follows contract.CameraModel (for a camera with rays, a subclass
of RayCamera in lens_models.py that names its lens from lenses/), add its line to MODELS and a fitter to fitting/.
The laws in tests/unit/models/test_models.py then hold for it.

Laws, for every example of every model: there and back is the same pixel; the shape of the points is kept;
a point out of reach is NaN; parameters survive JSON exactly; a fit on its own exact points returns itself;
too few points say how many are needed; a scaled image gives the scaled model.
"""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from touchline.core.geometry import Points
from touchline.core.registry import Registry
from touchline.models.contract import CameraModel, RayModel

__all__ = ["MODELS", "CameraModel", "RayModel", "field_from_raw", "model_from_json", "parameters_json",
           "raw_from_field"]

MODELS: Registry[type[CameraModel]] = Registry("camera model", {
    "polynomial": "touchline.models.polynomial:Polynomial",  # the paper's: two 1-D corrections from four borders
    "homography": "touchline.models.homography:Homography",  # no lens at all: eight numbers from four lines
    "thin-plate": "touchline.models.thin_plate:ThinPlate",  # of earlier versions, read and no longer fitted
    "division": "touchline.models.lens_models:Division",  # a pinhole with one distortion number
    "brown-conrady": "touchline.models.lens_models:BrownConrady",  # radial and tangential: nearly every field camera
    "fisheye": "touchline.models.lens_models:Fisheye",  # Kannala–Brandt, for very wide lenses
    "ssl": "touchline.models.lens_models:Ssl",  # the league's one term, for its software
})


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
    """Return asdict() with lists for tuples: what json.loads would give back."""
    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value
    return plain(asdict(model))
