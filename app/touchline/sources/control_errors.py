"""Refusals of a camera's controls, in the same words whichever way the camera is reached."""

from collections.abc import Iterable
from typing import Any

from touchline.core.errors import BadInput, NotFound
from touchline.core.statements import say


def unknown_control(name: Any, known: Iterable[str]) -> NotFound:
    """Return the error for a control that this camera lacks."""
    names = list(known)
    return NotFound(say("control.unknown", "This camera has no setting called {name!r}.", name=str(name)[:40]),
                    say("control.known", "It has: {names}.", names=names) if names
                    else say("control.none", "It has no settings that can be changed."), reason="unknown-control")


def refused_value(label: str, value: str, allowed: str) -> BadInput:
    """Return the error for a value that a control cannot have. value: as it is quoted."""
    return BadInput(f"{label} cannot be {value} on this camera.", f"Use {allowed}.", reason="bad-control")


def is_number(value: Any, low: float, high: float) -> bool:
    """Tell whether a control's value is a number in this range."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and low <= value <= high
