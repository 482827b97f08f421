"""The tiers of the tests, and how many seconds a test of each may take.

`tests/seconds.tsv` has a row (tier, seconds, test) for each test that is not of the default tier, or near its limit. A
test in the browser without a row is of the merge tier, any other one of the default tier; `long` ones are marked where
they are written. A run of all tests of the merge tier writes the seconds (tests/support/seconds.py); the tiers are
changed by hand.
"""

from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.support.paths import TESTS

SECONDS = TESTS / "seconds.tsv"
LIMITS_S = {
    "default": 0.5,
    # of the default tier all the same: the smallest example of what nothing quicker shows
    "smallest": 4.0,
    "story": 40.0,  # of the default tier, in a browser
    "merge": 120.0,
}
SCATTER = 1.5  # of one measurement, on a machine that is busy for a while
BROWSER = "tests/e2e/"


class Timed(NamedTuple):
    """How long a test took on a quiet machine with two cores, set-up and teardown included."""

    tier: str
    seconds: float


def long(*values: Any, id: str | None = None):
    """One set of parameters that is long."""
    return pytest.param(*values, marks=pytest.mark.long, id=id)


def rounds(name: str, few: Any, *more: Any):
    """A parameter that is few by default: seeds, pictures, rounds or examples; each of more is long."""
    return pytest.mark.parametrize(name, [few, *map(long, more)])


def read_seconds(path: Path = SECONDS) -> dict[str, Timed]:
    """Read the rows of a file of seconds by the test's id."""
    rows = (line.split("\t", 2) for line in path.read_text().splitlines()[1:])
    return {test: Timed(tier, float(seconds)) for tier, seconds, test in rows}


def write_seconds(timed: dict[str, Timed], path: Path = SECONDS) -> None:
    """Write them, sorted by the test's id."""
    rows = (f"{row.tier}\t{row.seconds:.2g}\t{test}\n" for test, row in sorted(timed.items()))
    path.write_text("tier\tseconds\ttest\n" + "".join(rows))


def tier_of(test: str, timed: dict[str, Timed]) -> str:
    """Return the tier of a test that is not marked `long`."""
    return timed[test].tier if test in timed else "merge" if test.startswith(BROWSER) else "default"


def outgrown(timed: dict[str, Timed]) -> list[str]:
    """Return a sentence for each test that takes longer than its tier allows."""
    return [
        f"{test} takes {row.seconds:.2g} s, and the {row.tier} tier allows {LIMITS_S[row.tier]:g} s"
        for test, row in timed.items()
        if row.seconds > SCATTER * LIMITS_S[row.tier]
    ]
