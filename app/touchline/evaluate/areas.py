"""Whether a picture shows the area that was chosen, or just a part of it that is an area of the field by itself.

A camera over half of a field fits its lines as well when the full field was chosen. What it then says of the other half
is a guess.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import TypedDict

from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize, Mask, Points, inside_picture
from touchline.core.sentences import area_name
from touchline.core.statements import Sentence, say
from touchline.fitting.field_pattern import is_half_turn_symmetric

CELLS = 48  # along the field
MIN_SEEN = 0.85  # of an area: less, and it may be another one that the picture shows
FITS_SEEN = 0.9  # of another area
# of another area with what is seen; where the chosen one cannot be matched
FITS_OVERLAP, NEAR_OVERLAP = 0.75, 0.5
# what is seen outside an area counts so much of what is not seen inside: then both rules agree
BEYOND = 0.25
QUARTER_TURN = 90
NOT_IN_IMAGE = "area-not-in-image"


class AreaJson(TypedDict):
    """region, rotate: as they are chosen; seen_share: of its carpet, in the picture."""

    region: str
    rotate: int
    seen_share: float


@dataclass(frozen=True)
class SeenArea:
    """An area that a picture shows, as it stands upright there. overlap: of it and what is seen of the field, the share
    that they have in common."""

    region: Region
    seen_share: float
    overlap: float

    def to_json(self) -> AreaJson:
        return {
            "region": self.region.name,
            "rotate": self.region.rotate_deg,
            "seen_share": self.seen_share,
        }


def better_areas(
    raw_from_field: Callable[[Points], Points],
    field: Field,
    region: Region,
    size: ImageSize,
    is_turnable: bool = False,
    least_overlap: float = FITS_OVERLAP,
) -> tuple[SeenArea, ...]:
    """Return the areas of the field to choose instead, the best first; empty where the chosen one is seen well enough,
    or no other fits better.

    raw_from_field: (n, 2) mm to raw px, NaN where it does not reach. is_turnable: whether lines cannot tell the field
    from the field turned by 180°; then the area opposite is as good, where it has a part of the chosen one.
    """
    cells = _cells(field)
    visible = inside_picture(raw_from_field(cells), size)
    if _seen_share(cells, region, visible) >= MIN_SEEN:
        return ()
    best = _best(cells, field, region, visible, raw_from_field, least_overlap)
    found = [best] if best is not None else []
    if is_turnable:
        turned = inside_picture(raw_from_field(-cells), size)
        opposite = _best(
            cells, field, region, turned, lambda points: raw_from_field(-points), least_overlap
        )
        found += [opposite] if opposite is not None else []
    return tuple(found)


def seen_area(
    raw_from_field: Callable[[Points], Points],
    field: Field,
    size: ImageSize,
    regions: Sequence[Region],
) -> SeenArea | None:
    """Return which of the regions a picture shows, as it stands upright there; None where it shows none well enough.

    A camera above a half also sees beyond it: what is seen of the field outside a region counts against it, but less
    than what is not seen of the region itself. Of a whole and its half, the whole is meant from MIN_SEEN of it on.
    """
    cells = _cells(field)
    visible = inside_picture(raw_from_field(cells), size)

    def fit(area: SeenArea) -> float:
        inside = _inside(cells, area.region)
        common = float((inside & visible).sum())
        return common / max(
            common + float((inside & ~visible).sum()) + BEYOND * float((visible & ~inside).sum()),
            1.0,
        )

    areas = [_seen_area(cells, region, visible) for region in regions]
    best = max(areas, key=fit, default=None)
    if best is None or best.overlap < NEAR_OVERLAP:
        return None
    return replace(best, region=_upright(best.region, raw_from_field))


def smaller_areas(field: Field, region: Region) -> tuple[Region, ...]:
    """Return the areas within the region, turned as that is, the largest first: each rectangle once, and one of two
    that are the same on a field turned by 180°."""
    found: dict[tuple[float, ...], Region] = {}
    is_turnable = is_half_turn_symmetric(field)
    for area in field.regions.values():
        (left, right), (bottom, top) = area.x_mm, area.y_mm
        is_within = (
            region.x_mm[0] <= left
            and right <= region.x_mm[1]
            and region.y_mm[0] <= bottom
            and top <= region.y_mm[1]
        )
        turned = (-right, -left, -top, -bottom)
        if (
            is_within
            and area.x_mm + area.y_mm not in (region.x_mm + region.y_mm, *found)
            and not (is_turnable and turned in found)
        ):
            found[left, right, bottom, top] = area.rotated(region.rotate_deg)
    return tuple(sorted(found.values(), key=lambda area: -area.width_mm * area.height_mm))


def area_sentences(areas: Sequence[SeenArea]) -> tuple[Sentence, Sentence]:
    """Return what is wrong with the chosen area, and what to do."""
    names = [area_name(area.region.name) for area in areas]
    if len(names) == 1:
        return (
            say(
                "seen-area.part",
                "The image shows only a part of the covered area: {area}.",
                area=names[0],
            ),
            say("seen-area.part.fix", "Choose the covered area that the image shows."),
        )
    return (
        say(
            "seen-area.either",
            "The image shows only a part of the covered area: {area} or {other}. Both match "
            "the lines.",
            area=names[0],
            other=names[1],
        ),
        say("seen-area.either.fix", "Choose the one that the camera is above."),
    )


def _best(
    cells: Points,
    field: Field,
    chosen: Region,
    visible: Mask,
    raw_from_field: Callable[[Points], Points],
    least_overlap: float,
) -> SeenArea | None:
    found: list[SeenArea] = []
    for region in field.regions.values():
        if (_inside(cells, region) & _inside(cells, chosen)).any():
            found.append(_seen_area(cells, region, visible))
    best = max(found, key=lambda area: area.overlap, default=None)
    if (
        best is None
        or best.seen_share < FITS_SEEN
        or best.overlap < least_overlap
        or best.region.name == chosen.name
    ):
        return None
    return replace(best, region=_upright(best.region, raw_from_field))


def _seen_area(cells: Points, region: Region, visible: Mask) -> SeenArea:
    inside = _inside(cells, region)
    overlap = float((inside & visible).sum() / max((inside | visible).sum(), 1))
    return SeenArea(region, _seen_share(cells, region, visible), overlap)


def _cells(field: Field) -> Points:
    """Return the middles (n, 2) mm of squares that cover the field."""
    step = field.length_mm / CELLS
    x, y = (
        np.arange(-side / 2 + step / 2, side / 2, step)
        for side in (field.length_mm, field.width_mm)
    )
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _inside(cells: Points, region: Region) -> Mask:
    low, high = (np.array([region.x_mm[i], region.y_mm[i]]) for i in (0, 1))
    return np.asarray(((cells >= low) & (cells <= high)).all(axis=1))


def _seen_share(cells: Points, region: Region, visible: Mask) -> float:
    inside = _inside(cells, region)
    return float(visible[inside].mean()) if inside.any() else 0.0


def _upright(region: Region, raw_from_field: Callable[[Points], Points]) -> Region:
    """Return the region with the quarter turn under which its top is nearest to the picture's top."""
    middle = np.array([np.mean(region.x_mm), np.mean(region.y_mm)])
    step_mm = 0.1 * min(np.ptp(region.x_mm), np.ptp(region.y_mm))
    ends = raw_from_field(middle + np.array([[-step_mm, 0.0], [step_mm, 0.0]]))
    across = ends[1] - ends[0]  # of the field's x in the picture, whose y runs down
    if not np.isfinite(across).all():
        return region
    turn = np.degrees(np.arctan2(-across[1], across[0]))
    return region.rotated(round(turn / QUARTER_TURN) * QUARTER_TURN % 360)
