"""Forms: checked values of JSON from outside. Strict: nothing unknown, no strings for numbers, nothing infinite.

Sizes are bounded here, so that what passes is small; what the values mean is checked again where they are used.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from touchline.core.geometry import MAX_COORDINATE

Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE, allow_inf_nan=False)]
Pair = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
Triple = Annotated[list[Coordinate], Field(min_length=2, max_length=3)]
HeightForm = Annotated[float, Field(ge=0, le=5000)]  # mm above the carpet
Side = Annotated[int, Field(ge=2, le=65536)]
Size = Annotated[list[Side], Field(min_length=2, max_length=2)]
Name = Annotated[str, Field(min_length=1, max_length=64)]
Rotate = Literal[0, 90, 180, 270]
Number = Annotated[float, Field(allow_inf_nan=False)]
OptionText = Annotated[str, Field(max_length=200)]
OptionValue = (
    bool
    | int
    | Number
    | OptionText
    | Annotated[list[OptionText], Field(max_length=20)]
    | Annotated[dict[OptionText, int | Number | OptionText], Field(max_length=8)]
    | None
)
OptionValues = Annotated[dict[str, OptionValue], Field(max_length=50)]
Note = Annotated[str, Field(max_length=2000)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class FittedModelForm(Strict):
    """A model as /fit/preview and GET /calibrations/{id} return it."""

    name: Name
    parameters: dict[str, Any]


class ObservationForm(Strict):
    """Where one feature of the field was seen on one image."""

    feature: Annotated[str, Field(min_length=1, max_length=200)] | Pair = Field(
        description="a border, line, arc or landmark of the field by name, or a field position [x, y] in mm"
    )
    kind: Literal["line", "landmark"] = "line"
    points: Annotated[list[Pair], Field(max_length=20_000)] = Field(
        description="[x, y] px in the raw image"
    )
    z_mm: Annotated[float, Field(ge=-10_000, le=10_000)] = 0.0
