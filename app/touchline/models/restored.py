"""What a stored calibration describes: its model, field and region."""

from typing import NamedTuple, Self

from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.records import Calibration
from touchline.models import CameraModel, model_from_json


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
