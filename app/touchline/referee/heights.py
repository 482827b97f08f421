"""How high a team's robots are, by its name in the game controller, in a table that vision-processor reads as well.

    table = merged_table(shipped, own)                        own entries win
    found = team_height(NOTHING, "tigers mannheim", table)     by hand, else heard, else not known

A name is looked up as it is, else without case, accents, spaces and punctuation.
"""

import unicodedata
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

import yaml

from touchline.core.errors import BadInput
from touchline.core.field_json import MAX_ROBOT_TOP_MM
from touchline.core.json_values import MAX_NAME, JsonObject
from touchline.core.statements import say
from touchline.core.strict_yaml import texts_from_yaml
from touchline.formats.numbers import number

Heights = Mapping[str, float]
Team = Literal["blue", "yellow"]
TEAMS: tuple[Team, ...] = ("blue", "yellow")
MIN_MM = 10.0
MAX_TEAMS = 500
HEADER = "# Team name in the game controller: robot height in mm\n"


@dataclass(frozen=True)
class TeamByHand:
    """What an operator entered of a team; either, both or nothing."""

    name: str | None = None
    height_mm: float | None = None


NOTHING = TeamByHand()


@dataclass(frozen=True)
class TeamHeight:
    """One team's height.

    team: its name. entry: of the table that has the height. height_mm: None where it is not known. source: where name
    or height is from; None where nothing was entered or heard.
    """

    team: str | None = None
    entry: str | None = None
    height_mm: float | None = None
    source: Literal["hand", "game-controller"] | None = None

    def to_json(self) -> JsonObject:
        return {**asdict(self), "known": self.height_mm is not None}


def folded(name: str) -> str:
    """Return a name without case, accents, spaces and punctuation; as it is where nothing else is in it."""
    plain = unicodedata.normalize("NFKD", name.casefold())
    return "".join(one for one in plain if one.isalnum()) or name


def checked_heights(heights: Heights) -> Heights:
    """Return the heights; BadInput for a name that no team has, or a height that no robot has."""
    if len(heights) > MAX_TEAMS:
        raise _refused(
            say("heights.too-many", "The table has more than {most} teams.", most=MAX_TEAMS)
        )
    for name, height_mm in heights.items():
        checked_name(name)
        checked_height(height_mm)
    return heights


def checked_name(name: str) -> None:
    """BadInput for what is not a team's name."""
    if not (0 < len(name) <= MAX_NAME and name.isprintable() and name == name.strip()):
        raise _refused(
            say("heights.bad-name", "{name!r} is not a team's name.", name=name[:MAX_NAME])
        )


def checked_height(height_mm: float) -> None:
    """BadInput for what is not a robot's height."""
    if not MIN_MM <= height_mm <= MAX_ROBOT_TOP_MM:
        raise _refused(
            say(
                "heights.bad-height",
                "{height_mm:g} mm is not a robot's height.",
                height_mm=height_mm,
            )
        )


def read_heights(data: bytes) -> Heights:
    """Read a file in the form of vision-processor's robot-heights.yml; BadInput."""
    match texts_from_yaml(data, "The file"):
        case [dict() as content] if content and all(isinstance(v, str) for v in content.values()):
            return checked_heights(
                {name: number(text, f"The height of {name[:40]}") for name, text in content.items()}
            )
    raise _refused(say("heights.bad-file", "The file is not a table of robot heights."))


def write_heights(heights: Heights) -> bytes:
    """Return the table as such a file."""
    return (HEADER + yaml.safe_dump(dict(heights), allow_unicode=True, sort_keys=False)).encode()


def merged_table(shipped: Heights, own: Heights) -> dict[str, float]:
    """Return both by name, in order; an own entry replaces each that is the same but for its spelling."""
    found = {
        folded(name): (name, height_mm)
        for table in (shipped, own)
        for name, height_mm in table.items()
    }
    return dict(found[key] for key in sorted(found))


def team_height(by_hand: TeamByHand, heard: str, table: Heights) -> TeamHeight:
    """Return a team's height: by hand, else the table's for the name by hand, else for the name that is heard."""
    name = by_hand.name or heard or None
    source: Literal["hand", "game-controller"] = "game-controller" if by_hand == NOTHING else "hand"
    if by_hand.height_mm is not None:
        return TeamHeight(name, None, by_hand.height_mm, source)
    if name is None:
        return TeamHeight()
    entry = next((one for one in table if folded(one) == folded(name)), None)
    return TeamHeight(name, entry, None if entry is None else table[entry], source)


def _refused(what: str) -> BadInput:
    return BadInput(
        what,
        say(
            "heights.form",
            "Give team names of at most {characters} characters and heights from {least:g} to {most:g} mm.",
            characters=MAX_NAME,
            least=MIN_MM,
            most=MAX_ROBOT_TOP_MM,
        ),
        reason="bad-robot-heights",
    )
