"""What the server's tables call things: the German page has words for all that they state, and for nothing else."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.refusals import API
from tests.support.statements import statements, values_of
from tests.support.words import STATEMENTS, entries, forms_of, messages
from touchline.api.middleware.problems import VALUE_FIXES
from touchline.core.json_values import FAULTS
from touchline.detection.stages import STAGES
from touchline.fitting import FITTERS
from touchline.models import MODELS

TABLES = {
    "source": "cameras/sources",
    "model": "models",
    "stage": "stages",
    "option": "stages",
    "setting": "settings",
    "field": "fields",
}  # by the first word of their codes


def stated_in(answer: Any) -> Iterator[tuple[str, str]]:
    """Yield the code and the English text of every sentence in an answer."""
    if isinstance(answer, list):
        for one in answer:
            yield from stated_in(one)
    elif isinstance(answer, dict):
        for name, said in answer.get("statements", {}).items():
            assert len(said) == 1
            yield said[0]["code"], answer[name]
        for name, value in answer.items():
            if name != "statements":
                yield from stated_in(value)


def test_the_german_page_has_words_for_every_fault_of_a_value():
    theirs = {key: forms for path in STATEMENTS["de"] for key, forms in entries(path)}
    templates = {
        f"{family}.{kind.replace('_', '-')}": template
        for family, table in (("fault", FAULTS), ("fault-fix", VALUE_FIXES))
        for kind, template in table.items()
    }
    assert {code for code in theirs if code.startswith(("fault.", "fault-fix."))} == {*templates}
    for code, template in templates.items():
        assert values_of(forms_of(theirs[code])["other"]) == values_of(template), code


def test_a_refused_value_and_option_are_stated(standing):
    missing = standing.post(f"{API}/fit/border", json={"model": "polynomial"}).json()
    assert missing["statements"]["detail"][0]["values"]["what"]["code"] == "fault.missing"
    assert missing["statements"]["fix"][0]["code"] == "fault-fix.missing"
    fit = {
        "field": "table",
        "region": "full",
        "observations": [{"feature": "left", "points": [[1, 2]]}],
        "image_size": [640, 480],
    }
    fit |= {"model": "polynomial", "options": {"degree": 99}}
    refused = standing.post(f"{API}/fit/preview", json=fit).json()
    stated = refused["statements"]
    assert stated["detail"][0]["values"]["name"]["code"] == "option-name.degree"
    assert stated["fix"][0]["values"]["allowed"]["code"] == "allowed.or-auto"


@pytest.fixture(scope="module")
def tables(standing, standing_calibration) -> dict[str, str]:
    """Return the English text of each code that the tables state."""
    found: dict[str, str] = {}
    for at in (
        *dict.fromkeys(TABLES.values()),
        f"calibrations/{standing_calibration['id']}/exports",
    ):
        for code, text in stated_in(standing.get(f"{API}/{at}").json()):
            assert found.setdefault(code, text) == text, f"{code} has two texts"
    return found


def test_the_german_page_has_words_for_exactly_what_the_tables_state(tables):
    theirs = {key for path in STATEMENTS["de"] for key, _ in entries(path)}
    families = {*TABLES, "format"}
    assert {code.partition(".")[0] for code in tables} == families
    assert {f"model.{name}" for name in MODELS} <= {*tables}
    assert {*tables} - theirs == set(), "no words for them"
    theirs -= {*statements()}  # by its name in the code
    assert {code for code in theirs if code.partition(".")[0] in families} - {*tables} == set(), (
        "never stated"
    )


def test_no_text_of_a_table_is_empty_or_a_template(tables):
    assert not [code for code, text in tables.items() if not text.strip() or "{" in text]


def test_the_page_has_a_name_for_every_option_that_it_shows():
    options = [
        option
        for table in (FITTERS, STAGES)
        for member in table.values()
        for option in member.OPTIONS
    ]
    assert not [
        it.name
        for it in options
        if f"calibrate.option.{it.name.replace('_', '-')}" not in messages()
    ]


def test_the_page_has_a_name_for_every_choice_that_it_shows():
    """Models are called by their titles; numbers and the terms of a lens, and whose sigma, are read as they are."""
    choices = {
        choice
        for table in (FITTERS, STAGES)
        for member in table.values()
        for it in member.OPTIONS
        for choice in it.choices
        if it.type in ("choice", "names") and it.name != "lens_sigma"
    }
    assert [
        choice
        for choice in sorted(choices)
        if not (
            choice.isdigit()
            or choice in MODELS
            or {f"calibrate.choice.{choice}", f"detection.colour.{choice}"} & messages().keys()
        )
    ] == []


def test_a_field_of_an_operator_keeps_its_title(standing):
    shipped = standing.get(f"{API}/fields/table").json()
    assert shipped["statements"] == {"title": [{"code": "field.table", "values": {}}]}
    # as it was shown
    own = standing.put(f"{API}/fields/own-table", json={**shipped, "name": "own-table"})
    assert (
        own.status_code == 200
        and own.json()["title"] == shipped["title"]
        and "statements" not in own.json()
    )
    assert standing.delete(f"{API}/fields/own-table").status_code == 204
