"""Heights of robots by team: the table, its file, and how a team's name is looked up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.paths import ROOT
from touchline.core.errors import BadInput
from touchline.core.strict_yaml import texts_from_yaml
from touchline.referee.heights import (
    NOTHING,
    TeamByHand,
    TeamHeight,
    merged_table,
    read_heights,
    team_height,
    write_heights,
)

SHIPPED = read_heights((ROOT / "configs" / "robot-heights.yml").read_bytes())
TABLE = merged_table(SHIPPED, {})


def test_the_table_that_comes_along_has_the_published_heights():
    assert len(TABLE) == len(SHIPPED) == 30
    assert (TABLE["ibis"], TABLE["ZJUNlict"], TABLE["CMμs"]) == (90, 148.725, 140)


@pytest.mark.parametrize(
    ("heard", "entry"),
    [
        ("TIGERs Mannheim", "TIGERs Mannheim"),
        ("tigers  mannheim", "TIGERs Mannheim"),
        ("ROBOCIN", "RobôCin"),
        ("NRG", "N.R.G"),
        ("CMµs", "CMμs"),  # the micro sign in place of the letter
        ("er force", "ER-Force"),
        ("Unknown", None),
        ("TIGERs", None),
    ],
)
def test_a_name_is_looked_up_as_it_is_else_without_case_accents_and_punctuation(heard, entry):
    found = team_height(NOTHING, heard, TABLE)
    assert found == TeamHeight(heard, entry, TABLE.get(entry), "game-controller")


def test_by_hand_wins_over_the_game_controller_and_a_height_over_a_name():
    def found(by_hand, heard="MRL"):
        return team_height(by_hand, heard, TABLE)

    assert found(TeamByHand("ibis")) == TeamHeight("ibis", "ibis", 90, "hand")
    assert found(TeamByHand("ibis", 95.0)) == TeamHeight("ibis", None, 95.0, "hand")
    assert found(TeamByHand(None, 95.0)) == TeamHeight("MRL", None, 95.0, "hand")
    assert found(TeamByHand("Ours")) == TeamHeight("Ours", None, None, "hand")
    assert found(NOTHING, "") == TeamHeight()


def test_an_own_entry_replaces_one_that_is_spelled_otherwise():
    table = merged_table(SHIPPED, {"Tigers mannheim": 145.0, "Ours": 100.0})
    assert "TIGERs Mannheim" not in table and len(table) == 31
    assert team_height(NOTHING, "TIGERs Mannheim", table).height_mm == 145.0


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"# nothing\n",
        b"- ibis\n",
        b"ibis\n",
        b"ibis: [90]\n",
        b"ibis: ninety\n",
        b"ibis: 90\nibis: 91\n",
        b"ibis: -90\n",
        b"ibis: .nan\n",
        b"ibis: 1e9\n",
        b"ibis: 90,5\n",
        b"ibis: 90\n---\nMRL: 150\n",
        b"&a ibis: 90\n",
        b"? [a, b]\n: 90\n",
        b'"": 90\n',
        b'" ibis": 90\n',
        b'"i\\nbis": 90\n',
        b"ibis: !!float 90\n",
        b"\xff\xfe",
        b"a" * 65 + b": 90\n",
        b"\n".join(b"team %d: 90" % i for i in range(501)),
        b"x" * 300_000,
    ],
    ids=range(22),
)
def test_a_file_that_is_no_table_of_heights_is_refused(data):
    with pytest.raises(BadInput):
        read_heights(data)


def test_a_name_is_text_whatever_yaml_makes_of_it():
    assert read_heights(b"No: 120\n1e3: 130\n2026-01-01: 140.5\nnull: 150\n") == {
        "No": 120,
        "1e3": 130,
        "2026-01-01": 140.5,
        "null": 150,
    }


@given(
    st.dictionaries(
        st.text(min_size=1, max_size=64).filter(lambda t: t.isprintable() and t == t.strip()),
        st.floats(10, 2000),
        min_size=1,
        max_size=5,
    )
)
def test_what_is_written_is_read_back_as_it_was(heights):
    assert read_heights(write_heights(heights)) == heights


def test_the_written_file_is_a_flat_mapping_with_a_comment():
    (content,) = texts_from_yaml(write_heights(TABLE), "It")
    assert content["ibis"] == "90.0" and write_heights(TABLE).startswith(b"# Team name")
