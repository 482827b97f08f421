"""Fields as the API shows them, and the calibrations that a change of one has made wrong."""

from touchline.core.field import Field, FieldJson
from touchline.core.records import Calibration
from touchline.core.statements import named, stated
from touchline.services.container import Services


class PlayingField(FieldJson):
    """A field as the API shows it. own: whether an operator made it, and may change it."""

    own: bool


def field_json(services: Services, field: Field) -> PlayingField:
    own = services.fields.is_own(field.name)
    is_shipped = not own and field.name in services.fields and field.title == services.fields[field.name].title
    title = named(f"field.{field.name}", field.title) if is_shipped else field.title
    shown: PlayingField = {**field.to_json(), "title": title, "own": own}
    return stated(shown)


def outdated_calibrations(services: Services, field: Field) -> list[Calibration]:
    """List the active calibrations that the field's changes have made wrong."""
    now = field.to_json()
    return [calibration for calibration in services.cameras.active_calibrations()
            if calibration.field["name"] == field.name and calibration.field_changes(now)]
