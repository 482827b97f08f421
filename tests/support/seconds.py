"""A plugin of pytest that writes the seconds of a whole run to tests/seconds.tsv (python -m tests --merge).

What a test has for itself counts: its set-up, its call and its teardown, without the fixtures that it shares with
others, which the first of them would pay for. A busy or a slower machine stretches all tests alike: the seconds are
divided by the median stretch of those that the file knows already. A row changes only where the difference is more than
one measurement scatters.
"""

import time
from collections import defaultdict
from statistics import median

import pytest

from tests.support.tiers import (
    BROWSER,
    LIMITS_S,
    SCATTER,
    Timed,
    read_seconds,
    tier_of,
    write_seconds,
)

NEAR = 0.8  # default tests below this part of their limit have no row
TINY_S = 0.1  # a difference that is no reason to write another figure

seconds: dict[str, float] = defaultdict(float)
left_out: set[str] = set()  # long, skipped or failed
shared_s: list[float] = []  # of the fixtures that the present test has set up for others too


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    started_s = time.perf_counter()
    try:
        return (yield)
    finally:
        if fixturedef.scope != "function":
            shared_s.append(time.perf_counter() - started_s)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(call):
    """In the process of the test; the report takes what was shared to the one that writes."""
    report = yield
    report.shared_s = sum(shared_s)
    shared_s.clear()
    return report


def pytest_runtest_logreport(report) -> None:
    seconds[report.nodeid] += max(report.duration - report.shared_s, 0)
    if not report.passed or "long" in report.keywords:
        left_out.add(report.nodeid)


def pytest_sessionfinish(session, exitstatus) -> None:
    """In the one process that hears of all tests; a run that was stopped would forget the rows of the others."""
    whole = (
        exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED) and not session.shouldfail
    )
    if whole and not hasattr(session.config, "workerinput"):
        measured = {test: took for test, took in seconds.items() if test not in left_out}
        write_seconds(updated(read_seconds(), measured, left_out))


def updated(
    known: dict[str, Timed], measured: dict[str, float], unmeasured: set[str]
) -> dict[str, Timed]:
    """Return the rows after a run: of what it measured, what it left out, and what another kind of run measures."""
    ratios = [took / known[test].seconds for test, took in measured.items() if test in known]
    stretch = median(ratios) if ratios else 1.0
    browser = any(test.startswith(BROWSER) for test in measured)
    rows = {
        test: row
        for test, row in known.items()
        if test in unmeasured or test.startswith(BROWSER) != browser
    }
    for test, took in measured.items():
        tier, now = tier_of(test, known), took / stretch
        before = known[test].seconds if test in known else now
        if abs(now - before) < TINY_S or 1 / SCATTER <= now / before <= SCATTER:
            now = before
        if tier != "default" or now > NEAR * LIMITS_S["default"]:
            rows[test] = Timed(tier, now)
    return rows
