"""Read a field from plain data, and find what has changed of the one that a calibration rests on.

The form of a field is the one that Field.to_json writes and the REST contract shows. Lengths are mm. Optional
shorthands: `line_width_mm` for all markings that give none, and a region either as {x, y, rotate} or as its four border
lines.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import (
    BORDERS,
    DEFAULT_LINE_WIDTH_MM,
    LINE_SIGMA_MM,
    QUARTER_TURNS,
    ROBOT_TOP_MM,
    Arc,
    Field,
    Landmark,
    Line,
    Point,
    Region,
)
from touchline.core.sentences import AREAS, area_name, marking_name
from touchline.core.statements import STATEMENTS, Sentence, say

NAMED = 3  # in a sentence
FIELD_CHANGED_FIX = say(
    "field-change.calibrate-again",
    "Calibrate it again from its saved points, then activate the new version.",
)
SIZE = say("field-change.size", "its size")

NAME = re.compile(r"[a-z0-9]+(?:-[a-z0-9]+)*")
MAX_NAME = 64
MAX_ROBOT_TOP_MM = 2000.0  # a grown-up humanoid
MAX_LINE_SIGMA_MM = 200.0
MIN_SIDE_MM, MAX_SIDE_MM = 100.0, 100_000.0  # a table top to a stadium
MAX_MEMBERS = 500  # of each kind; the richest league field has 60
SAME_MM = 0.01  # two ways to say one place may differ by this
# of half a side: a region's edge lies along its line, which may have been taped outside the field
BESIDE = 0.05
T = TypeVar("T")


def field_changes(
    before: Mapping[str, Any], now: Mapping[str, Any], region: str, observed: Iterable[Any]
) -> tuple[str, ...]:
    """Name what lies elsewhere in `now` than in `before`, or is gone, and would make a calibration wrong.

    Both are fields as Field.to_json writes them. A calibration rests on the field's size, its region, every line and
    arc, and the landmarks among its observed features; markings that were added, line widths, other regions and words
    leave it right.
    """
    return tuple(_changes(before, now, region, observed))


def _changes(
    before: Mapping[str, Any], now: Mapping[str, Any], region: str, observed: Iterable[Any]
) -> Iterator[str]:
    if any(before[side] != now[side] for side in ("length_mm", "width_mm")):
        yield SIZE
    then, today = before["regions"].get(region), now["regions"].get(region)
    if today is None or (
        then is not None and any(then[axis] != today[axis] for axis in ("x", "y"))
    ):
        yield region
    here = _places(now)
    for name, place in _places(before).items():
        if here.get(name) != place:
            yield name
    landmarks = before["landmarks"]
    for name in dict.fromkeys(
        name for name in observed if isinstance(name, str) and name in landmarks
    ):
        if now["landmarks"].get(name) != landmarks[name]:
            yield name


def _places(field: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Return where each line and arc lies; a line is the same from either end."""
    lines = {
        line["name"]: tuple(sorted((tuple(line["from"]), tuple(line["to"]))))
        for line in field["lines"]
    }
    arcs = {
        arc["name"]: (*arc["centre"], arc["radius_mm"], arc["start_deg"], arc["end_deg"])
        for arc in field["arcs"]
    }
    return lines | arcs


def changes_in_words(changes: Sequence[str]) -> Sentence:
    """Return "its size", "centre circle and left half", or the first three and how many more."""
    names = [
        SIZE if name == SIZE else area_name(name) if name in AREAS else marking_name(name)
        for name in changes
    ]
    if len(names) > NAMED:
        return say(
            "field-change.more",
            "{names} and {more} more",
            names=names[:NAMED],
            more=len(names) - NAMED,
        )
    if len(names) > 1:
        return say("field-change.several", "{names} and {last}", names=names[:-1], last=names[-1])
    return names[0]


Named = TypeVar("Named", Line, Arc, Landmark, Region)


def field_from_json(value: Any) -> Field:
    """The field that plain data describes; BadInput says which entry is wrong and what it should be."""
    keys(
        value,
        "",
        ("name", "length_mm", "width_mm", "regions"),
        (
            "title",
            "line_width_mm",
            "lines",
            "arcs",
            "landmarks",
            "hat_height_mm",
            "line_sigma_mm",
            "extras",
            "own",
            STATEMENTS,
        ),
    )  # the last two: as GET /fields tells it
    name = safe_name(value["name"], "name")
    length = number(value["length_mm"], "length_mm", MIN_SIDE_MM, MAX_SIDE_MM)
    width = number(value["width_mm"], "width_mm", MIN_SIDE_MM, MAX_SIDE_MM)
    thick = number(value.get("line_width_mm", DEFAULT_LINE_WIDTH_MM), "line_width_mm", 0.1, 500)
    # markings may lie outside the field, as goals do, but not by more than half of it
    far = (length, width)
    lines = members(value.get("lines", []), "lines", lambda v, at: _line(v, at, far, thick))
    arcs = members(value.get("arcs", []), "arcs", lambda v, at: _arc(v, at, far, thick))
    landmarks = table(
        value.get("landmarks", {}), "landmarks", lambda key, v, at: Landmark(key, point(v, at, far))
    )
    regions = table(
        value["regions"], "regions", lambda key, v, at: _region(key, v, at, length, width)
    )
    if not regions:
        raise refuse("regions is empty.", 'Give at least the region "full".', "regions")
    _every_name_once(lines, arcs, landmarks)
    return Field(
        name,
        text(value.get("title", name), "title", 120),
        length,
        width,
        lines,
        arcs,
        landmarks,
        regions,
        _extras(value.get("extras", {}), landmarks),
        number(value.get("hat_height_mm", ROBOT_TOP_MM), "hat_height_mm", 1, MAX_ROBOT_TOP_MM),
        number(value.get("line_sigma_mm", LINE_SIGMA_MM), "line_sigma_mm", 0, MAX_LINE_SIGMA_MM),
    )


def _line(value: Any, at: str, far: Point, thick: float) -> Line:
    keys(value, at, ("name", "from", "to"), ("width_mm",))
    line = Line(
        safe_name(value["name"], f"{at}.name"),
        point(value["from"], f"{at}.from", far),
        point(value["to"], f"{at}.to", far),
        number(value.get("width_mm", thick), f"{at}.width_mm", 0.1, 500),
    )
    if line.length_mm < 1:
        raise refuse(f"{at} ({line.name}) has no length.", "Give it two different ends.", at)
    return line


def _arc(value: Any, at: str, far: Point, thick: float) -> Arc:
    keys(value, at, ("name", "centre", "radius_mm"), ("start_deg", "end_deg", "width_mm"))
    arc = Arc(
        safe_name(value["name"], f"{at}.name"),
        point(value["centre"], f"{at}.centre", far),
        number(value["radius_mm"], f"{at}.radius_mm", 1, max(far)),
        number(value.get("start_deg", 0.0), f"{at}.start_deg", -720, 720),
        number(value.get("end_deg", 360.0), f"{at}.end_deg", -720, 720),
        number(value.get("width_mm", thick), f"{at}.width_mm", 0.1, 500),
    )
    if not 0 < arc.end_deg - arc.start_deg <= 360:
        raise refuse(
            f"{at} ({arc.name}) runs from {arc.start_deg:g}° to {arc.end_deg:g}°.",
            "Give end_deg above start_deg, by at most 360.",
            f"{at}.end_deg",
        )
    return arc


def _region(name: str, value: Any, at: str, length: float, width: float) -> Region:
    """From x and y, from the four borders, or from both if they agree."""
    keys(value, at, (), ("name", "x", "y", "rotate", "width_mm", "height_mm", *BORDERS))
    if value.get("name", name) != name:
        raise refuse(
            f"{at} has another name inside: {value['name']!r}.", "Give it one name.", f"{at}.name"
        )
    by_lines = all(border in value for border in BORDERS)
    if "x" in value and "y" in value:
        rotate = value.get("rotate", 0)
        if isinstance(rotate, bool) or rotate not in QUARTER_TURNS:
            raise refuse(f"{at}.rotate is {rotate!r}.", "Use 0, 90, 180 or 270.", f"{at}.rotate")
        x_mm, y_mm = (
            _span(value["x"], f"{at}.x", length / 2),
            _span(value["y"], f"{at}.y", width / 2),
        )
        region = Region(name, x_mm, y_mm, int(rotate))
        if by_lines and _border_gap(region, value, at, (length, width)) > SAME_MM:
            raise refuse(
                f"The four borders of {at} disagree with its x, y and rotate.",
                "Send only one of them.",
                at,
            )
        return region
    if by_lines:
        return _region_from_borders(name, value, at, length, width)
    raise refuse(
        f"{at} has neither x and y nor all four borders.",
        'Send {"x": [from, to], "y": [from, to]} in mm, or the lines left, right, top and bottom.',
        at,
    )


def _region_from_borders(name: str, value: Any, at: str, length: float, width: float) -> Region:
    """The rectangle and the quarter turn at which each border stands where its name says."""
    ends = np.array(
        [_ends(value[border], f"{at}.{border}", (length, width)) for border in BORDERS]
    ).reshape(-1, 2)
    (x0, y0), (x1, y1) = ends.min(axis=0), ends.max(axis=0)
    x_mm = _span([float(x0), float(x1)], f"{at} in x", length / 2)
    y_mm = _span([float(y0), float(y1)], f"{at} in y", width / 2)
    turned = [Region(name, x_mm, y_mm, turn) for turn in QUARTER_TURNS]
    best = min(turned, key=lambda region: _border_gap(region, value, at, (length, width)))
    if _border_gap(best, value, at, (length, width)) > SAME_MM:
        raise refuse(
            f"The four borders of {at} do not form an upright rectangle.",
            "Left, top, right and bottom must meet at the corners, along x and y of the field.",
            at,
        )
    return best


def _border_gap(region: Region, value: Mapping[str, Any], at: str, far: Point) -> float:
    """Largest distance in mm from a border's ends to those given, in whichever order they are given."""
    gaps = []
    for line in map(region.border, BORDERS):
        given, ours = (
            np.array(_ends(value[line.name], f"{at}.{line.name}", far)),
            np.array([line.start, line.end]),
        )
        gaps.append(min(np.abs(given - ours).max(), np.abs(given[::-1] - ours).max()))
    return float(max(gaps))


def _ends(value: Any, at: str, far: Point) -> tuple[Point, Point]:
    keys(value, at, ("from", "to"), ("name", "width_mm"))
    return point(value["from"], f"{at}.from", far), point(value["to"], f"{at}.to", far)


def _span(value: Any, at: str, half: float) -> tuple[float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise refuse(f"{at} is not a pair of numbers.", "Send [from, to] in mm.", at)
    far = half * (1 + BESIDE)
    low, high = (number(v, at, -far, far) for v in value)
    if high - low < 10:
        raise refuse(
            f"{at} runs from {low:g} to {high:g} mm.",
            "Send the smaller number first. Both must be at least 10 mm apart.",
            at,
        )
    return low, high


def _extras(value: Any, landmarks: Mapping[str, Landmark]) -> dict[str, Any]:
    """What is drawn and published but not fitted. Every key is known, so that nothing is carried unread."""
    sizes = {
        "boundary": ("touch_mm", "goal_mm"),
        "goal": ("width_mm", "depth_mm", "height_mm"),
        "ball": ("radius_mm",),
        "robot": ("radius_mm", "height_mm"),
    }
    keys(value, "extras", (), (*sizes, "corner_cut_mm", "carpet", "marks", "note"))
    extras: dict[str, Any] = {}
    for key, given in value.items():
        at = f"extras.{key}"
        if key in sizes:
            keys(given, at, sizes[key], ())
            extras[key] = {
                size: number(given[size], f"{at}.{size}", 0, MAX_SIDE_MM) for size in sizes[key]
            }
        elif key == "corner_cut_mm":
            extras[key] = number(given, at, 0, MAX_SIDE_MM)
        elif key == "carpet":
            extras[key] = choice(given, at, ("green", "black"))
        elif key == "note":
            extras[key] = text(given, at, 500)
        else:
            extras[key] = [
                _mark(item, f"{at}[{i}]", landmarks)
                for i, item in enumerate(limited(given, at, list))
            ]
    return extras


def _mark(value: Any, at: str, landmarks: Mapping[str, Landmark]) -> dict[str, Any]:
    keys(value, at, ("at", "shape", "size_mm"), ())
    return {
        "at": choice(value["at"], f"{at}.at", tuple(landmarks)),
        "shape": choice(value["shape"], f"{at}.shape", ("dot", "cross")),
        "size_mm": number(value["size_mm"], f"{at}.size_mm", 1, 1000),
    }


def _every_name_once(lines: Iterable[str], arcs: Iterable[str], landmarks: Iterable[str]) -> None:
    taken = set(BORDERS)  # an observation's "left" means the region's border
    entries = [(name, f"lines[{i}].name") for i, name in enumerate(lines)]
    entries += [(name, f"arcs[{i}].name") for i, name in enumerate(arcs)]
    for name, entry in (*entries, *((name, f"landmarks.{name}") for name in landmarks)):
        if name in taken:
            raise refuse(
                f"The name {name!r} is used twice, or is the name of a border.",
                "Give every line, arc and landmark a unique name.",
                entry,
            )
        taken.add(name)


def refuse(what: str, fix: str, entry: str = "") -> BadInput:
    """Return the refusal of one entry, such as "lines[3].to"; "" is the whole field."""
    return BadInput(what, fix, reason="bad-field", entry=entry)


def keys(value: Any, at: str, required: tuple[str, ...], optional: tuple[str, ...]) -> None:
    """Check that value is a mapping with these keys and no others."""
    if not isinstance(value, Mapping):
        raise refuse(
            f"{at or 'The field'} is not an object.",
            f"Send an object with {', '.join(required or optional)}.",
            at,
        )
    for key in required:
        if key not in value:
            raise refuse(
                f"{at or 'The field'} has no {key}.", f"Add {key}.", f"{at}.{key}".lstrip(".")
            )
    for key in value:
        if key not in required and key not in optional:
            raise refuse(
                f"{at or 'The field'} has an unknown entry {str(key)[:MAX_NAME]!r}.",
                f"Use only: {', '.join((*required, *optional))}.",
                at,
            )


def number(value: Any, at: str, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        shown = repr(value) if isinstance(value, float) else "not a valid number"
        raise refuse(f"{at} is {shown}.", f"Send a number from {low:g} to {high:g}.", at)
    return float(value)


def point(value: Any, at: str, far: Point) -> Point:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise refuse(
            f"{at} is not a pair of numbers.", "Send [x, y] in mm from the field's centre.", at
        )
    return number(value[0], at, -far[0], far[0]), number(value[1], at, -far[1], far[1])


def safe_name(value: Any, at: str) -> str:
    if not isinstance(value, str) or len(value) > MAX_NAME or not NAME.fullmatch(value):
        raise refuse(
            f"{at} is not a valid name.",
            f"Use lower-case letters, digits and single hyphens, at most {MAX_NAME} characters, such as "
            "my-field-2.",
            at,
        )
    return value


def text(value: Any, at: str, longest: int) -> str:
    if not isinstance(value, str) or len(value) > longest or not value.isprintable():
        raise refuse(
            f"{at} is not plain text.", f"Send one line of at most {longest} characters.", at
        )
    return value


def choice(value: Any, at: str, allowed: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in allowed:
        raise refuse(f"{at} has an unknown value.", f"Use one of: {', '.join(allowed)}.", at)
    return value


def limited(value: Any, at: str, kind: type[list[Any] | dict[Any, Any]]) -> Any:
    if not isinstance(value, kind) or len(value) > MAX_MEMBERS:
        raise refuse(
            f"{at} is no {'list' if kind is list else 'mapping'} of at most {MAX_MEMBERS}.",
            f"Send {'[…]' if kind is list else '{name: …}'}, or leave it out.",
            at,
        )
    return value


def members(value: Any, at: str, read: Callable[[Any, str], Named]) -> dict[str, Named]:
    """A list of named things as a table by name."""
    found = [read(item, f"{at}[{i}]") for i, item in enumerate(limited(value, at, list))]
    names: dict[str, Named] = {}
    for i, item in enumerate(found):
        if item.name in names:
            raise refuse(
                f"Two {at} have the name {item.name}.",
                "Give each a unique name.",
                f"{at}[{i}].name",
            )
        names[item.name] = item
    return names


def table(value: Any, at: str, read: Callable[[str, Any, str], T]) -> dict[str, T]:
    return {
        safe_name(key, at): read(key, item, f"{at}.{key}")
        for key, item in limited(value, at, dict).items()
    }
