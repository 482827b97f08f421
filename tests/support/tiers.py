"""Parameters of which the first is tried by default and the others only in the long tier."""

from typing import Any

import pytest


def long(*values: Any, id: str | None = None):
    """One set of parameters that is long."""
    return pytest.param(*values, marks=pytest.mark.long, id=id)


def rounds(name: str, few: Any, *more: Any):
    """A parameter that is few by default: seeds, pictures, rounds or examples; each of more is long."""
    return pytest.mark.parametrize(name, [few, *map(long, more)])
