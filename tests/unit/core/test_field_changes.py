"""Which changes of a field make a calibration wrong that was made before."""

import pytest

from touchline.core.field_json import changes_in_words, field_changes
from touchline.store.fields import load_fields

FIELD = load_fields()["ssl-div-b"].to_json()
OBSERVED = ("left", "centre-line", "penalty-mark-left", (1.0, 2.0))


def changed(**entries):
    return field_changes(FIELD, {**FIELD, **entries}, "half-left", OBSERVED)


def moved(list_of, name, **entries):
    return [{**one, **entries} if one["name"] == name else one for one in FIELD[list_of]]


@pytest.mark.parametrize(
    ("entries", "named"),
    [
        ({"length_mm": 8990.0}, ("its size",)),
        (
            {"lines": moved("lines", "defence-left-front", **{"from": [-3400.0, -1000.0]})},
            ("defence-left-front",),
        ),
        (
            {"lines": [line for line in FIELD["lines"] if line["name"] != "centre-line"]},
            ("centre-line",),
        ),
        ({"arcs": moved("arcs", "centre-circle", radius_mm=515.0)}, ("centre-circle",)),
        (
            {"landmarks": {**FIELD["landmarks"], "penalty-mark-left": [-1515.0, 0.0]}},
            ("penalty-mark-left",),
        ),
        (
            {
                "regions": {
                    **FIELD["regions"],
                    "half-left": {**FIELD["regions"]["half-left"], "x": [-4500.0, 100.0]},
                }
            },
            ("half-left",),
        ),
        ({"regions": {"full": FIELD["regions"]["full"]}}, ("half-left",)),
    ],
)
def test_what_it_rests_on_is_named_where_it_lies_elsewhere_or_is_gone(entries, named):
    assert changed(**entries) == named


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"title": "Another"},
        {"hat_height_mm": 90.0},
        {"line_sigma_mm": 0.0},
        {"extras": {}},
        {"lines": moved("lines", "centre-line", width_mm=50.0)},
        {"lines": moved("lines", "centre-line", **{"from": [4500.0, 0.0], "to": [-4500.0, 0.0]})},
        {
            "lines": [
                *FIELD["lines"],
                {"name": "extra", "from": [0.0, 0.0], "to": [9.0, 9.0], "width_mm": 10.0},
            ]
        },
        {"landmarks": {**FIELD["landmarks"], "penalty-mark-right": [1515.0, 0.0]}},
        {
            "regions": {
                **FIELD["regions"],
                "half-right": {**FIELD["regions"]["half-right"], "x": [10.0, 4500.0]},
            }
        },
    ],
    ids=lambda entries: next(iter(entries), "nothing"),
)
def test_what_it_does_not_rest_on_leaves_it_right(entries):
    assert changed(**entries) == ()


def test_a_sentence_names_three_at_most():
    assert (
        changes_in_words(("its size", "half-left", "centre-circle"))
        == "its size, left half and centre circle"
    )
    assert changes_in_words(("a",)) == "a"
    assert changes_in_words(("a", "b")) == "a and b"
    assert changes_in_words(("a", "b", "c")) == "a, b and c"
    assert changes_in_words(tuple("abcdef")) == "a, b, c and 3 more"
