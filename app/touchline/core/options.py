"""One setting of a fit, a source or a stage, described well enough to check it and to build a form from it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from touchline.core.errors import BadInput
from touchline.core.json_values import PointJson, in_words, number
from touchline.core.statements import Sentence, Stated, named, say, stated


class OptionJson(Stated):
    name: str
    type: str
    default: Any
    help: str
    range: PointJson | None
    unit: str | None
    choices: list[str]


@dataclass(frozen=True)
class Option:
    """range: smallest and largest number; choices: of "choice", "names" and "terms-or-auto"."""

    name: str
    type: str  # "int", "float", "bool", "choice", "int-or-auto", "names": a list of choices
    default: Any
    help: str
    range: tuple[float, float] | None = None
    unit: str | None = None
    choices: tuple[str, ...] = ()

    def read(self, value: Any) -> Any:
        """The value, checked; BadInput says what is allowed."""
        if value is None:
            return self.default
        if self.type == "choice":
            return self._checked(value, value in self.choices, self._one_of())
        if self.type == "terms-or-auto":
            if value == "auto":
                return value
            if isinstance(value, (list, tuple)) and all(v in self.choices for v in value):
                return tuple(c for c in self.choices if c in value)
            raise self._refuse(value, _or_auto(self._list_from()))
        if self.type == "names":
            given = [part.strip() for part in value.split(",")] if isinstance(value, str) else value
            if isinstance(given, (list, tuple)) and given and all(v in self.choices for v in given):
                return tuple(given)
            raise self._refuse(value, self._list_from())
        if self.type == "value-and-sigma":
            return self._read_value_and_sigma(value)
        if self.type == "calibration":
            found = (
                isinstance(value, Mapping)
                and "name" in value
                and (
                    isinstance(value.get("parameters"), Mapping)
                    or isinstance(value.get("lens"), Mapping)
                )
            )
            return self._checked(
                value, found, say("allowed.calibration", "the id of a calibration")
            )
        if self.type == "bool":
            return self._checked(
                value, isinstance(value, bool), say("allowed.bool", "true or false")
            )
        if self.type == "int-or-auto" and value == "auto":
            return value
        allowed = self._numbers()
        if number(value) is None or (self.range and not self.range[0] <= value <= self.range[1]):
            raise self._refuse(value, allowed)
        if self.type.startswith("int"):
            if value != int(value):
                raise self._refuse(
                    value, say("allowed.whole", "a whole number, {such}", such=allowed)
                )
            return int(value)
        return float(value)

    def _read_value_and_sigma(self, value: Any) -> dict[str, float]:
        low, high = self.range or (-inf, inf)
        allowed = say(
            "allowed.value-and-sigma",
            "a value from {low:g} to {high:g} {unit} and its uncertainty from 0.1 to 5000 {unit}, "
            'as "value" and "sigma"',
            low=low,
            high=high,
            unit=self.unit,
        )
        if not isinstance(value, Mapping) or set(value) != {"value", "sigma"}:
            raise self._refuse(value, allowed)
        found, sigma = number(value["value"]), number(value["sigma"])
        if found is None or not low <= found <= high:
            raise self._refuse(value["value"], allowed)
        if sigma is None or not 0.1 <= sigma <= 5000:
            raise self._refuse(value["sigma"], allowed)
        return {"value": found, "sigma": sigma}

    def _numbers(self) -> Sentence:
        low, high = self.range or (None, None)
        some = (
            say("allowed.number", "a number")
            if low is None
            else say("allowed.range", "a number from {low:g} to {high:g}", low=low, high=high)
        )
        return _or_auto(some) if self.type == "int-or-auto" else some

    def _one_of(self) -> Sentence:
        return say("allowed.one-of", "one of {choices}", choices=[f'"{c}"' for c in self.choices])

    def _list_from(self) -> Sentence:
        return say("allowed.list", "a list from {choices}", choices=self.choices)

    def _checked(self, value: Any, good: bool, allowed: str) -> Any:
        if not good:
            raise self._refuse(value, allowed)
        return value

    def _refuse(self, value: Any, allowed: str) -> BadInput:
        return BadInput(
            say(
                "option.refused",
                "The option {name} cannot be {value}.",
                name=named(
                    f"option-name.{self.name}", self.name.removesuffix("_mm").replace("_", " ")
                ),
                value=" ".join(
                    filter(
                        None, (in_words(value), (number(value) is not None and self.unit) or None)
                    )
                ),
            ),
            say(
                "option.refused.fix",
                "Use {allowed}, for {name}.",
                allowed=allowed,
                name=named(f"option-name.{self.name}", self.name),
            ),
            reason="bad-option",
        )

    def to_json(self, of: str | None = None) -> OptionJson:
        """of: whose option it is, for the code of its help; None where no page shows that."""
        return stated(
            OptionJson(
                name=self.name,
                type=self.type,
                default=self.default,
                help=self.help if of is None else named(f"option.{of}.{self.name}", self.help),
                range=list(self.range) if self.range else None,
                unit=self.unit,
                choices=list(self.choices),
            )
        )


def _or_auto(allowed: Sentence) -> Sentence:
    return say("allowed.or-auto", '{such}, or "auto"', such=allowed)


def read_options(described: Iterable[Option], given: Mapping[str, Any] | None) -> dict[str, Any]:
    """Every described option with its given or default value; an unknown one is refused by name."""
    table = {option.name: option for option in described}
    given = given or {}
    for name in given:
        if name not in table:
            raise BadInput(
                say("option.unknown", "Unknown option: {name!r}.", name=name),
                say("option.unknown.fix", "Use one of: {names}.", names=list(table)),
                reason="unknown-option",
            )
    return {name: option.read(given.get(name)) for name, option in table.items()}
