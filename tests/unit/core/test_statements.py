"""Sentences that know what they state: plain text for everybody, codes and values beside it."""

import copy
import json
import pickle

import pytest

from touchline.core.statements import Sentence, join, named, read_statements, say, stated


def test_a_sentence_is_text_and_states_its_values_as_they_are_shown():
    said = say(
        "verdict.expected", "Expected error: {mm:.1f} mm of {share:.0f} %.", mm=2.34, share=49.6
    )
    assert said == "Expected error: 2.3 mm of 50 %."
    assert said.statements == ({"code": "verdict.expected", "values": {"mm": 2.3, "share": 50.0}},)
    assert json.loads(json.dumps(said)) == str(said)


@pytest.mark.parametrize(
    ("unit", "value", "shown"),
    [
        ("mm", 0.26, "0.3"),
        ("mm", 9.94, "9.9"),
        ("mm", 9.96, "10"),
        ("mm", 123.4, "123"),
        ("px", 0.123, "0.12"),
        ("px", 0.996, "1.0"),
        ("px", -3.456, "-3.5"),
        ("percent", 4.56, "4.6"),
        ("percent", 45.6, "46"),
        ("mm", float("nan"), "nan"),
    ],
)
def test_a_number_has_the_digits_of_its_unit(unit, value, shown):
    said = say("a", f"It is {{x:{unit}}} {unit}.", x=value)
    assert said == f"It is {shown} {unit}."
    assert said.statements[0]["values"]["x"] == (shown if shown == "nan" else float(shown))


def test_names_and_sentences_within_a_sentence_are_stated_by_themselves():
    line = say("line.halfway-line", "halfway line")
    said = say(
        "check.missing", "Not detected: {lines} ({n}).", lines=[line, "mine"], n=float("nan")
    )
    assert said == "Not detected: halfway line, mine (nan)."
    assert said.statements[0]["values"] == {
        "lines": [{"code": "line.halfway-line", "values": {}}, "mine"],
        "n": "nan",
    }


def test_sentences_are_joined_with_what_they_state_and_plain_text_states_itself():
    both = join(say("a", "One."), "", "Two.")
    assert both == "One. Two."
    assert both.statements == ({"code": "a", "values": {}}, {"text": "Two."})


def test_a_record_gets_what_its_sentences_state_beside_them():
    record = {"level": "good", "sentence": say("a", "One."), "fix": ""}
    assert stated(record) == {**record, "statements": {"sentence": [{"code": "a", "values": {}}]}}
    assert stated({"sentence": "One."}) == {"sentence": "One."}


def test_a_list_of_texts_has_one_statement_for_each():
    notes = ["mine", say("note.b", "Two {n}.", n=2)]
    assert stated({"notes": notes}) == {
        "notes": ["mine", "Two 2."],
        "statements": {"notes": [{"text": "mine"}, {"code": "note.b", "values": {"n": 2.0}}]},
    }
    assert stated({"notes": ["mine"], "at": (1, 2)}) == {"notes": ["mine"], "at": (1, 2)}


def test_the_text_of_a_table_is_no_template():
    said = named("option.ball.least_size", "As {it} is.")
    assert said == "As {it} is."
    assert said.statements == ({"code": "option.ball.least-size", "values": {}},)


def test_a_sentence_survives_copies_and_processes():
    said = say("a", "One {n}.", n=1)
    for copied in (copy.deepcopy(said), pickle.loads(pickle.dumps(said))):
        assert copied == said
        assert isinstance(copied, Sentence)
        assert copied.statements == said.statements


def test_what_is_no_statement_is_not_read():
    good = {"sentence": [{"code": "a", "values": {}}]}
    assert read_statements({**good, "fix": "text", 3: [], "text": [4]}) == good
    assert read_statements(["a"]) == {}
    assert len(read_statements({"text": [{}] * 30})["text"]) == 20
