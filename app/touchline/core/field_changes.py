"""What of a field a calibration rests on, and what of that has changed since: a field's name says nothing of it."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from touchline.core.marking_names import AREAS, area_name, marking_name
from touchline.core.statements import Sentence, say

NAMED = 3  # in a sentence
FIELD_CHANGED_FIX = say("field-change.calibrate-again",
                        "Calibrate it again from its saved points, then activate the new version.")
SIZE = say("field-change.size", "its size")


def field_changes(before: Mapping[str, Any], now: Mapping[str, Any], region: str,
                  observed: Iterable[Any]) -> tuple[str, ...]:
    """Name what lies elsewhere in `now` than in `before`, or is gone, and would make a calibration wrong.

    Both are fields as Field.to_json writes them. A calibration rests on the field's size, its region, every line and
    arc, and the landmarks among its observed features; markings that were added, line widths, other regions and words
    leave it right.
    """
    return tuple(_changes(before, now, region, observed))


def _changes(before: Mapping[str, Any], now: Mapping[str, Any], region: str, observed: Iterable[Any]) -> Iterator[str]:
    if any(before[side] != now[side] for side in ("length_mm", "width_mm")):
        yield SIZE
    then, today = before["regions"].get(region), now["regions"].get(region)
    if today is None or (then is not None and any(then[axis] != today[axis] for axis in ("x", "y"))):
        yield region
    here = _places(now)
    for name, place in _places(before).items():
        if here.get(name) != place:
            yield name
    landmarks = before["landmarks"]
    for name in dict.fromkeys(name for name in observed if isinstance(name, str) and name in landmarks):
        if now["landmarks"].get(name) != landmarks[name]:
            yield name


def _places(field: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Return where each line and arc lies; a line is the same from either end."""
    lines = {line["name"]: tuple(sorted((tuple(line["from"]), tuple(line["to"])))) for line in field["lines"]}
    arcs = {arc["name"]: (*arc["centre"], arc["radius_mm"], arc["start_deg"], arc["end_deg"]) for arc in field["arcs"]}
    return lines | arcs


def changes_in_words(changes: Sequence[str]) -> Sentence:
    """Return "its size", "centre circle and left half", or the first three and how many more."""
    names = [SIZE if name == SIZE else area_name(name) if name in AREAS else marking_name(name) for name in changes]
    if len(names) > NAMED:
        return say("field-change.more", "{names} and {more} more", names=names[:NAMED], more=len(names) - NAMED)
    if len(names) > 1:
        return say("field-change.several", "{names} and {last}", names=names[:-1], last=names[-1])
    return names[0]
