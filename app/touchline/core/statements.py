"""Sentences that know what they state: English text for everybody, a code and values for scripts and other languages.

A sentence is an ordinary string. Where a record with sentences becomes JSON, stated() puts beside them, by the name of
their entry, the list of what each states.
"""

import math
import re
from collections.abc import Mapping
from string import Formatter
from typing import Any, TypeVar

from typing_extensions import TypedDict  # of typing's own, pydantic reads none before Python 3.12

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MIN_PLAIN = 1e-6  # below it noughts are no longer counted: 3.1 × 10⁻⁸
MAX_PLAIN = 1e6
MIN_SIGMA = 1e-300  # a σ below it is none

# of a number in a sentence, by the format of its place, {px:px}: a limit, and the digits below and from it
UNIT_DIGITS = {"mm": (10, 1, 0), "px": (1, 2, 1), "percent": (10, 1, 0)}

STATEMENTS = "statements"  # the entry beside the sentences
MAX_STATEMENTS = 20  # of an entry, as read from a file


def format_number(value: float, digits: int = 2) -> str:
    """With that many significant digits, whole parts in full: 0.26, 1.5, 124, −0.000064, 3.1 × 10⁻⁸."""
    if not math.isfinite(value):
        return "unknown"
    rounded = float(f"{value:.{digits - 1}e}")
    power = _power(rounded)
    if rounded != 0 and not MIN_PLAIN <= abs(rounded) < MAX_PLAIN:
        # 10⁻³²⁴ is no number to divide by
        mantissa = f"{rounded:.{digits - 1}e}".partition("e")[0].replace("-", "−")
        return f"{mantissa} × 10{str(power).translate(SUPERSCRIPT)}"
    if power >= digits:
        return _fixed(value, 0)  # 124, not 120: whole parts in full
    text = _fixed(rounded, max(0, digits - 1 - power))
    return text.rstrip("0").rstrip(".") if "." in text else text


def format_with_sigma(value: float, sigma: float) -> str:
    """A value and how well it is known, to two digits of its σ: −0.000064 ± 0.00008, (−6.4 ± 8) × 10⁻⁸."""
    if not (math.isfinite(value) and math.isfinite(sigma) and sigma > MIN_SIGMA):
        return format_number(value)
    power = _power(sigma)
    if not MIN_PLAIN <= sigma < MAX_PLAIN:
        both = f"({_fixed(value / 10.0**power, 1)} ± {format_number(sigma / 10.0**power)})"
        return f"{both} × 10{str(power).translate(SUPERSCRIPT)}"
    return f"{_fixed(value, max(0, 1 - power))} ± {format_number(sigma)}"


def format_mm(value: float) -> str:
    """Millimetres, to a tenth below 10."""
    return f"{_in_unit(value, 'mm')} mm"


def _in_unit(value: Any, spec: str) -> str:
    """Return a value as str.format does, and with the digits of a unit of UNIT_DIGITS that its format names."""
    if spec not in UNIT_DIGITS:
        return format(value, spec)
    limit, fine, coarse = UNIT_DIGITS[spec]
    return f"{value:.{fine if round(abs(value), fine) < limit else coarse}f}"


class _Template(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        return _in_unit(value, format_spec)


def _power(value: float) -> int:
    """Of ten, of the first digit."""
    return int(f"{value:e}".partition("e")[2])


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text.replace("-", "−" if float(text) else "", 1)


def sentence(text: str) -> str:
    """A sentence that may begin with a name we gave, "image 3" or "view 3"; a file's name stays as it is written."""
    return re.sub(r"\A(?:image|picture|view)(?= \d)", lambda name: name[0].capitalize(), text)


Record = TypeVar("Record", bound=Mapping[str, Any])


class Stated(TypedDict, total=False):
    """JSON with sentences: by the name of each, what it states; absent where none is known."""

    statements: dict[str, Any]


class Sentence(str):
    """Text with what it states, in order: mappings with `code`, kebab-case words joined by dots, and `values`.

    Made by say() and join(). Any other way of changing or joining it gives an ordinary string.
    """

    statements: tuple[Mapping[str, Any], ...]

    def __new__(cls, text: str, statements: tuple[Mapping[str, Any], ...] = ()) -> "Sentence":
        made = super().__new__(cls, text)
        made.statements = statements
        return made


def say(code: str, template: str, **values: object) -> Sentence:
    """Return a template of str.format with its values in their places.

    The values are stated as they are shown: a number rounded as its format says, or as its unit does in UNIT_DIGITS, a
    list of names as a list, and a value that is a sentence itself by its own statements.
    """
    shown = {
        name: ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else value
        for name, value in values.items()
    }
    formats = {name: spec or "" for _, name, spec, _ in Formatter().parse(template) if name}
    return Sentence(
        _Template().format(template, **shown),
        (
            {
                "code": code,
                "values": {
                    name: _value(value, formats.get(name, "")) for name, value in values.items()
                },
            },
        ),
    )


def named(code: str, text: str) -> Sentence:
    """Return the text of a table's entry, as it is: no template. code: of the table's ids, their _ written as -."""
    return Sentence(text, ({"code": code.replace("_", "-"), "values": {}},))


def join(*parts: str) -> Sentence:
    """Return sentences behind one another, the empty ones left out; plain text among them states itself."""
    found = [part for part in parts if part]
    return Sentence(
        " ".join(found), tuple(statement for part in found for statement in statements_of(part))
    )


def capitalised(text: str) -> Sentence:
    """Return a sentence or a name as it begins one, stating the same."""
    return Sentence(text[:1].upper() + text[1:], statements_of(text))


def statements_of(text: str) -> tuple[Mapping[str, Any], ...]:
    """Return what a text states; plain text as a statement without a code."""
    return (
        text.statements
        if isinstance(text, Sentence) and text.statements
        else ({"text": str(text)},)
    )


def stated(record: Record) -> Record:
    """Return a record as plain JSON, with what its sentences state beside them; of a list of texts, one for each."""
    json: Any = dict(record)
    found = {
        name: list(value.statements)
        for name, value in record.items()
        if isinstance(value, Sentence)
    }
    found |= {
        name: [statements_of(text)[0] for text in value]
        for name, value in record.items()
        if isinstance(value, (list, tuple)) and any(isinstance(text, Sentence) for text in value)
    }
    if found:
        json[STATEMENTS] = {**json.get(STATEMENTS, {}), **found}
    return json


def sentence_in(record: Mapping[str, Any], name: str) -> str:
    """Return a sentence of a record that stated() has made, also where it has been JSON since."""
    text = record[name]
    found = (
        None if isinstance(text, Sentence) else read_statements(record.get(STATEMENTS)).get(name)
    )
    return Sentence(text, tuple(found)) if found else text


def read_statements(value: Any) -> dict[str, Any]:
    """Return the entry as it may come from a file: lists of statements by name, without what is none."""
    rows = value.items() if isinstance(value, Mapping) else ()
    return {
        name: found[:MAX_STATEMENTS]
        for name, found in rows
        if isinstance(name, str)
        and isinstance(found, list)
        and all(isinstance(one, Mapping) for one in found)
    }


def _value(value: object, spec: str) -> Any:
    if isinstance(value, Sentence):
        return statements_of(value)[0]
    if isinstance(value, (list, tuple)):
        return [_value(one, "") for one in value]
    if isinstance(value, str):
        return value
    shown = _in_unit(value, spec)
    try:
        found = float(shown)  # as many digits as are shown
    except ValueError:
        return shown
    return found if math.isfinite(found) else shown
