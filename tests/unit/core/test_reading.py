"""Plain data is read strictly, and a refusal says in plain words which entry is wrong."""

from dataclasses import dataclass
from typing import Annotated, Literal, NotRequired

import pytest
from annotated_types import Interval, Len, Predicate
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.json_values import Whole, read


@dataclass(frozen=True)
class Spot:
    at: tuple[float, float]
    size: Annotated[int, Interval(ge=1, le=9)] = 1
    round: bool = False
    turns: Annotated[int, Interval(ge=0, le=3), Whole()] = 0


class Sheet(TypedDict):
    name: Annotated[str, Len(1, 5), Predicate(str.isprintable)]
    spots: Annotated[list[Spot], Len(1, 3)]
    kind: NotRequired[Literal["a", "b"]]


SHEET = {"name": "one", "spots": [{"at": [1, 2.5]}]}


def refusal(value):
    with pytest.raises(BadInput) as refused:
        read(Sheet, value, "The sheet", "Send another.", "bad-sheet")
    assert (refused.value.fix, refused.value.reason) == ("Send another.", "bad-sheet")
    return refused.value.what


@pytest.mark.parametrize(
    ("turns", "read_as"), [(2, 2), (2.0, 2), (2.5, None), ("2", None), (True, None), (4.0, None)]
)
def test_a_whole_number_may_be_written_with_a_point_where_its_type_says_so(turns, read_as):
    value = {**SHEET, "spots": [{"at": [1, 2], "turns": turns}]}
    if read_as is None:
        assert "spots[0].turns is " in refusal(value)
    else:
        (spot,) = read(Sheet, value, "", "", "")["spots"]
        assert (spot.turns, type(spot.turns)) == (read_as, int)


def test_lists_are_read_as_tuples_and_objects_as_records():
    assert read(Sheet, SHEET, "", "", "") == {"name": "one", "spots": [Spot((1.0, 2.5))]}


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"name": 3}, "name is not a text"),
        ({"name": ""}, "name is too short"),
        ({"name": "a\n"}, "name is not valid"),
        ({"name": "a" * 9}, "name has more than 5 characters"),
        ({"kind": "c"}, "kind is not one of 'a', 'b'"),
        ({"more": 1}, "more is unknown"),
        ({"spots": {}}, "spots is not a list"),
        ({1: 2}, "1 is unknown"),
        ({"spots": []}, "spots has fewer than 1 entries"),
        ({"spots": [3]}, "spots[0] is not an object"),
        ({"spots": [{}]}, "spots[0].at is missing"),
        ({"spots": [{"at": [1]}]}, "spots[0].at[1] is missing"),
        ({"spots": [{"at": [1, "2"]}]}, "spots[0].at[1] is not a number"),
        ({"spots": [{"at": [1, True]}]}, "spots[0].at[1] is not a number"),
        ({"spots": [{"at": [1, float("nan")]}]}, "spots[0].at[1] is not a number"),
        ({"spots": [{"at": [float("-inf"), 1]}]}, "spots[0].at[0] is not a number"),
        ({"spots": [{"at": [1, -(10**400)]}]}, "spots[0].at[1] is not a number"),
        ({"spots": [{"at": [1, 2], "size": 1.5}]}, "spots[0].size is not a whole number"),
        ({"spots": [{"at": [1, 2], "size": 10**400}]}, "spots[0].size is more than 9"),
        ({"spots": [{"at": [1, 2], "size": 0}]}, "spots[0].size is less than 1"),
        ({"spots": [{"at": [1, 2], "round": 1}]}, "spots[0].round is neither true nor false"),
        ({"spots": [{"at": [1, 2], "colour": 1}]}, "spots[0].colour is unknown"),
    ],
)
def test_a_refusal_names_the_entry(change, what):
    assert refusal({**SHEET, **change}) == f"The sheet: {what}."


def nested(levels):
    value = []
    for _ in range(levels):
        value = [value]
    return value


@pytest.mark.parametrize(
    "value",
    [
        None,
        3,
        [SHEET],
        {},
        {**SHEET, "name": "\ud800"},
        {**SHEET, "\ud800": 1},
        {**SHEET, "name": object()},
        {**SHEET, "name": 10**9999},
        {**SHEET, (1, 2): 3},
        {**SHEET, "x" * 10_000: 1},
    ],
    ids=lambda value: type(value).__name__,
)
def test_whatever_is_given_the_refusal_is_short(value):
    assert refusal(value).startswith("The sheet") and len(refusal(value)) < 200


@pytest.mark.parametrize("levels", [300, 100_000])
def test_lists_within_lists_are_refused_however_deep(levels):
    answer = refusal({**SHEET, "spots": nested(levels)})
    assert answer.startswith("The sheet") and len(answer) < 200
