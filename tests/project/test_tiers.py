"""No test has grown over its tier, and each part of the code is tested by what is run for it."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.support import seconds
from tests.support.capabilities import CAPABILITIES, TESTS, files_of, files_touched, matches
from tests.support.paths import ROOT
from tests.support.seconds import updated
from tests.support.tiers import LIMITS_S, Timed, outgrown, read_seconds, tier_of

TIMED = read_seconds()
STORIES = 6
SMALLEST_S = 200  # all of them together


def test_no_test_has_grown_over_its_tier():
    """Where one has: make it smaller, compute once for several, or give it the next tier in tests/seconds.tsv."""
    assert outgrown(TIMED) == []


def test_a_test_that_has_grown_would_be_named():
    grown = {
        "tests/a.py::test_it": Timed("default", 0.9),
        "tests/a.py::test_that": Timed("default", 0.6),
    }
    assert outgrown(grown) == ["tests/a.py::test_it takes 0.9 s, and the default tier allows 0.5 s"]


def test_the_default_tier_stays_small():
    of = [row for row in TIMED.values() if row.tier == "smallest"]
    assert sum(row.seconds for row in of) <= SMALLEST_S
    assert sum(row.tier == "story" for row in TIMED.values()) <= STORIES


def test_every_row_is_of_a_test_that_is_there():
    assert {row.tier for row in TIMED.values()} <= set(LIMITS_S)
    names = {
        (path, name.split("[")[0]) for path, _, name in (test.partition("::") for test in TIMED)
    }
    sources = {
        path: (ROOT / path).read_text() if (ROOT / path).exists() else "" for path, _ in names
    }
    assert (
        sorted(f"{path}::{name}" for path, name in names if f"def {name}(" not in sources[path])
        == []
    )


def test_seconds_of_a_busy_machine_count_as_those_of_a_quiet_one():
    known = {f"tests/a.py::test_{i}": Timed("merge", 1.0) for i in range(5)}
    measured = {
        **dict.fromkeys(known, 4.0),
        "tests/a.py::test_4": 12.0,
        "tests/a.py::test_new": 4.0,
        "tests/a.py::test_quick": 1.0,
    }
    rows = updated(known, measured, set())
    assert rows["tests/a.py::test_0"] == Timed("merge", 1.0)
    assert rows["tests/a.py::test_4"] == Timed("merge", 3.0)
    assert rows["tests/a.py::test_new"] == Timed("default", 1.0)
    assert "tests/a.py::test_quick" not in rows


def test_a_run_keeps_the_rows_that_it_did_not_measure():
    known = {
        "tests/e2e/test_a.py::test_it": Timed("story", 9.0),
        "tests/a.py::test_skipped": Timed("merge", 3.0),
        "tests/a.py::test_gone": Timed("merge", 3.0),
    }
    rows = updated(known, {"tests/a.py::test_it": 0.1}, {"tests/a.py::test_skipped"})
    assert set(rows) == {"tests/e2e/test_a.py::test_it", "tests/a.py::test_skipped"}


def test_a_run_that_was_stopped_writes_nothing(monkeypatch):
    """It would forget the tiers of all tests that it did not reach."""
    written = []
    monkeypatch.setattr(seconds, "write_seconds", written.append)
    session = SimpleNamespace(config=SimpleNamespace(), shouldfail=False)
    for code in (pytest.ExitCode.INTERRUPTED, pytest.ExitCode.INTERNAL_ERROR):
        seconds.pytest_sessionfinish(session, code)
    seconds.pytest_sessionfinish(
        SimpleNamespace(config=SimpleNamespace(), shouldfail="after one"),
        pytest.ExitCode.TESTS_FAILED,
    )
    assert written == []
    seconds.pytest_sessionfinish(session, pytest.ExitCode.TESTS_FAILED)
    assert len(written) == 1


def test_what_has_no_row_is_a_default_test_but_in_the_browser():
    assert tier_of("tests/unit/test_new.py::test_it", {}) == "default"
    assert tier_of("tests/e2e/test_new.py::test_it[chromium]", {}) == "merge"


@pytest.mark.parametrize("name", CAPABILITIES)
def test_each_capability_has_code_and_tests_by_its_name(name):
    code = [
        path
        for pattern in ("app/touchline/**/*.py", "static/features/**/*.js", "static/core/**/*.js")
        for path in ROOT.glob(pattern)
        if matches(str(path.relative_to(ROOT)), CAPABILITIES[name])
    ]
    assert len(code) >= 3 and len(files_of(name)) >= 3
    for pattern in CAPABILITIES[name]:
        assert any(
            matches(str(path.relative_to(ROOT)), [pattern])
            for top in ("app", "static", "tests")
            for path in (ROOT / top).rglob("*")
        ), f"{name}: nothing is called {pattern}"


def test_a_change_asks_for_the_files_of_its_capability_of_the_kernel_for_everything():
    rigs = files_touched(["app/touchline/services/rigs.py", "README.md"])
    assert "tests/api/test_rest_rigs.py" in rigs and "tests/e2e/test_rig_matches.py" in rigs
    assert rigs == files_of("rigs")
    assert (
        files_touched(["app/touchline/services/rigs.py", "app/touchline/core/records.py"]) is None
    )
    assert files_touched(["tests/unit/store/test_store.py"]) == ["tests/unit/store/test_store.py"]
    assert files_touched(["README.md", "static/help/rigs.md"]) == []
    assert files_touched(["app/touchline/store/a_new_file.py"]) is None


def test_every_test_outside_the_project_can_be_asked_for():
    files = [str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("test_*.py")]
    assert [
        path
        for path in files
        if not matches(path, TESTS) and not Path(path).is_relative_to("tests/project")
    ] == []
