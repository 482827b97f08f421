"""Requests about lenses without a field: boards, straight edges, and pairs of cameras."""

from typing import Annotated, Literal

from pydantic import Field

from app.core.geometry import MAX_COORDINATE
from app.services.value_types import (
    Coordinate,
    Name,
    Note,
    Number,
    OptionText,
    OptionValues,
    Pair,
    Size,
    Strict,
    Triple,
)

Height = Annotated[float, Field(ge=0, le=5000)]


class BoardViewForm(Strict):
    """One view of a board: corners in the picture, and where they are on the board."""

    image_points: Annotated[list[Pair], Field(max_length=10_000)] = Field(description="[x, y] px in the raw picture")
    object_points: Annotated[list[Triple], Field(max_length=10_000)] = Field(description="[x, y, z] mm on the board")
    name: Annotated[str, Field(max_length=200)] = ""


class BoardRequest(Strict):
    """Pictures of a board, or views of it, from which a lens is found."""

    snapshots: Annotated[list[Name], Field(min_length=1, max_length=500)] | None = None
    views: Annotated[list[BoardViewForm], Field(min_length=1, max_length=1000)] | None = None
    image_size: Size | None = None
    board: Annotated[dict[OptionText, bool | int | Number | OptionText], Field(max_length=10)] | None = Field(
        None, description='{"kind": "chessboard" or "charuco", "columns", "rows" (inner corners), "square_mm"}; a '
                          'charuco board has "marker_mm", "dictionary" and "legacy" too')
    model: Name = "brown-conrady"
    options: OptionValues = Field({})
    camera: Name | None = None
    note: Note = ""


class PairRequest(Strict):
    """The same things in two pictures, two calibrations over one field, or both."""

    points_a: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in picture a; null for one that is not clicked yet and only counts")
    points_b: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="and in picture b")
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: Height | Annotated[list[Height | None], Field(max_length=20_000)] = Field(
        0.0, description="height of the matched things, mm: of all, or of each, null where it is not known")


class PairLinesRequest(Strict):
    """Points in the pictures of a pair, for their epipolar lines: by a matrix, or by two calibrations."""

    points_a: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in picture a")
    points_b: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in picture b")
    matrix: Annotated[list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
                      Field(min_length=3, max_length=3)] | None = Field(None, description="as `POST /pairs` returns it")
    image_size_a: Size | None = Field(None, description="[width, height] px, with a matrix")
    image_size_b: Size | None = None
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: Height | None = Field(0.0, description="height of the things, mm; null where it is not known")


class StraightnessRequest(Strict):
    """Pictures of one camera, lines clicked in the first of them (or in none), or both."""

    snapshots: Annotated[list[Name], Field(max_length=50)] = Field([])
    lines: Annotated[list[Annotated[list[Pair], Field(max_length=20_000)]], Field(max_length=2000)] = Field(
        [], description="[[x, y], …] px along one straight edge each")
    image_size: Size | None = Field(None, description="of the picture, where there are only lines")
    lens: Name = Field("auto", description="division, division-even, brown-conrady, or auto")
    centre_sigma_px: Annotated[float, Field(ge=0, le=MAX_COORDINATE)] | None = Field(
        None, description="how far the lens' centre may be from the picture's; 0 holds it, 1 % of the diagonal by "
                          "default")


class PlumbLensForm(Strict):
    """A lens as `lens` of a response on straightness."""

    name: Name
    terms: Annotated[dict[OptionText, Coordinate], Field(max_length=10)]
    centre_px: Pair
    image_size: Size
    unit: Literal["half-diagonal"] = "half-diagonal"
    unit_px: Number | None = None


class StraightenedRequest(Strict):
    """A picture, and the lens whose distortion is removed."""

    snapshot: Name
    lens: PlumbLensForm
