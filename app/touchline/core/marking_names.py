"""What borders, markings and areas of fields are called in sentences: marking_name("touch-line-top"), "top touch line".

Names stand in lower case and without article. The page's catalogues have the same, static/core/words/en/markings.js and
areas.js. Fields of operators have names of their own, which are read as they are written: "my-line", "my line".
"""

from collections.abc import Sequence

from touchline.core.statements import Sentence, say

MARKINGS = {
    "left": "left border",
    "right": "right border",
    "top": "top border",
    "bottom": "bottom border",
    "touch-line": "touch line",
    "goal-line": "goal line",
    "touch-line-top": "top touch line",
    "touch-line-bottom": "bottom touch line",
    "goal-line-left": "left goal line",
    "goal-line-left-middle": "middle of the left goal line",
    "goal-line-right": "right goal line",
    "goal-line-right-middle": "middle of the right goal line",
    "halfway-line": "halfway line",
    "centre-line": "centre line",
    "halfway-top": "top end of the halfway line",
    "halfway-bottom": "bottom end of the halfway line",
    "centre": "field centre",
    "centre-circle": "centre circle",
    "circle-top": "top point of the centre circle",
    "circle-bottom": "bottom point of the centre circle",
    "circle-left": "left point of the centre circle",
    "circle-right": "right point of the centre circle",
    "goal-left-post-top": "top post of the left goal",
    "goal-left-post-bottom": "bottom post of the left goal",
    "penalty-mark-left": "left penalty mark",
    "goal-right-post-top": "top post of the right goal",
    "goal-right-post-bottom": "bottom post of the right goal",
    "penalty-mark-right": "right penalty mark",
    "defence-left-front": "front line of the left defence area",
    "defence-left-top": "top line of the left defence area",
    "defence-left-bottom": "bottom line of the left defence area",
    "defence-left-corner-top": "top front corner of the left defence area",
    "defence-left-foot-top": "top rear corner of the left defence area",
    "defence-left-corner-bottom": "bottom front corner of the left defence area",
    "defence-left-foot-bottom": "bottom rear corner of the left defence area",
    "defence-left-middle": "front middle of the left defence area",
    "defence-left-arc-top": "top arc of the left defence area",
    "defence-left-arc-bottom": "bottom arc of the left defence area",
    "defence-right-front": "front line of the right defence area",
    "defence-right-top": "top line of the right defence area",
    "defence-right-bottom": "bottom line of the right defence area",
    "defence-right-corner-top": "top front corner of the right defence area",
    "defence-right-foot-top": "top rear corner of the right defence area",
    "defence-right-corner-bottom": "bottom front corner of the right defence area",
    "defence-right-foot-bottom": "bottom rear corner of the right defence area",
    "defence-right-middle": "front middle of the right defence area",
    "defence-right-arc-top": "top arc of the right defence area",
    "defence-right-arc-bottom": "bottom arc of the right defence area",
    "goal-area-left-front": "front line of the left goal area",
    "goal-area-left-top": "top line of the left goal area",
    "goal-area-left-bottom": "bottom line of the left goal area",
    "goal-area-left-corner-top": "top front corner of the left goal area",
    "goal-area-left-foot-top": "top rear corner of the left goal area",
    "goal-area-left-corner-bottom": "bottom front corner of the left goal area",
    "goal-area-left-foot-bottom": "bottom rear corner of the left goal area",
    "goal-area-left-arc": "arc of the left goal area",
    "goal-area-left-arc-top": "top end of the left goal area arc",
    "goal-area-left-arc-bottom": "bottom end of the left goal area arc",
    "goal-area-right-front": "front line of the right goal area",
    "goal-area-right-top": "top line of the right goal area",
    "goal-area-right-bottom": "bottom line of the right goal area",
    "goal-area-right-corner-top": "top front corner of the right goal area",
    "goal-area-right-foot-top": "top rear corner of the right goal area",
    "goal-area-right-corner-bottom": "bottom front corner of the right goal area",
    "goal-area-right-foot-bottom": "bottom rear corner of the right goal area",
    "goal-area-right-arc": "arc of the right goal area",
    "goal-area-right-arc-top": "top end of the right goal area arc",
    "goal-area-right-arc-bottom": "bottom end of the right goal area arc",
    "corner-top-left": "top left corner",
    "cut-top-left-touch": "top left corner cut at the touch line",
    "cut-top-left-goal": "top left corner cut at the goal line",
    "cross-top-left": "top left cross",
    "corner-top-right": "top right corner",
    "cut-top-right-touch": "top right corner cut at the touch line",
    "cut-top-right-goal": "top right corner cut at the goal line",
    "cross-top-right": "top right cross",
    "corner-bottom-left": "bottom left corner",
    "cut-bottom-left-touch": "bottom left corner cut at the touch line",
    "cut-bottom-left-goal": "bottom left corner cut at the goal line",
    "cross-bottom-left": "bottom left cross",
    "corner-bottom-right": "bottom right corner",
    "cut-bottom-right-touch": "bottom right corner cut at the touch line",
    "cut-bottom-right-goal": "bottom right corner cut at the goal line",
    "cross-bottom-right": "bottom right cross",
    "cross-left": "left cross",
    "cross-right": "right cross",
}

AREAS = {
    "full": "full field",
    "half": "half, goal line on top",
    "half-left": "left half",
    "half-right": "right half",
    "quarter-top-left": "top left quarter",
    "quarter-top-right": "top right quarter",
    "quarter-bottom-left": "bottom left quarter",
    "quarter-bottom-right": "bottom right quarter",
    "eighth-0": "outer bottom left eighth",
    "eighth-1": "outer top left eighth",
    "eighth-2": "inner bottom left eighth",
    "eighth-3": "inner top left eighth",
    "eighth-4": "inner bottom right eighth",
    "eighth-5": "inner top right eighth",
    "eighth-6": "outer bottom right eighth",
    "eighth-7": "outer top right eighth",
}


def marking_name(id: str) -> Sentence:
    """Return the name of a border, line, arc or landmark, stated as "line.touch-line-top"; another's as plain text."""
    return _name(id, MARKINGS, "line")


def area_name(id: str) -> Sentence:
    """Return the name of an area, stated as "area.half-left"; another's as plain text."""
    return _name(id, AREAS, "area")


def marking_names(ids: Sequence[str]) -> list[Sentence]:
    return [marking_name(id) for id in ids]


def _name(id: str, table: dict[str, str], part: str) -> Sentence:
    return say(f"{part}.{id}", table[id]) if id in table else Sentence(id.replace("-", " ").replace("_", " "))


def the_border(id: str | None) -> Sentence:
    """Return "the left border", with its name as what it states; "the border" where it has no id."""
    called = marking_name(id) if id else Sentence("border")
    return Sentence(f"the {called}", called.statements)
