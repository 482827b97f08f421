"""What all tests share: small worlds to import, real data from beside the project, and the shell."""

import io
import os
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import settings

from tests.support.leftovers import forget_cached, leftovers
from tests.support.paths import SHARED_DATA as DATA
from tests.support.postgres import PostgresServer, programs
from tests.support.store_opener import StoreOpener
from tests.support.tiers import BROWSER, read_seconds, tier_of
from tests.support.waiting import until
from touchline.cli import main

settings.register_profile("same every time", derandomize=True, deadline=None)
settings.load_profile("same every time")
# no test starts after it, where it is not 0
UNTIL_S = float(os.environ.get("TOUCHLINE_TESTS_UNTIL", "0"))


def pytest_collection_modifyitems(items):
    """Mark what is in the merge tier or needs a browser; where the time is limited, the quick files come first."""
    timed = read_seconds()
    took_s = defaultdict(float)
    for item in items:
        if item.nodeid.startswith(BROWSER):
            item.add_marker(pytest.mark.e2e)
        if tier_of(item.nodeid, timed) == "merge":
            item.add_marker(pytest.mark.merge)
            took_s[item.path] += timed[item.nodeid].seconds if item.nodeid in timed else 0
    if UNTIL_S:
        items.sort(key=lambda item: (took_s[item.path], item.path))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    if 0 < UNTIL_S < time.time():
        pytest.skip("the time of this run is up")


@pytest.fixture(scope="module", autouse=True)
def there_before(request):
    """What was there before the tests of a file; what they shared is gone after them."""
    before = leftovers()
    yield before
    forget_cached(request.module)
    until(lambda: leftovers() - before, lambda left: not left)


@pytest.fixture(autouse=True)
def nothing_is_left(request, there_before):
    """A test that leaves a process, a thread or a file behind fails by its own name.

    Where tests share a server, whose threads and processes come and go, the last one of the file does.
    """
    before = leftovers()
    yield
    if before == there_before and "standing" not in request.fixturenames:
        until(lambda: leftovers() - before, lambda left: not left)


@pytest.fixture(scope="session")
def real_data():
    """Look up a real file beside the project; tests that need one that is not there are skipped by its name."""

    def find(name: str) -> Path:
        path = DATA / name
        if not path.exists():
            pytest.skip(f"real data is not beside the project: {name}")
        return path

    return find


@pytest.fixture
def touchline(monkeypatch, capsys, tmp_path):
    """Run a command in tmp_path: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*words, stdin=""):
        monkeypatch.setattr(sys, "argv", ["touchline", *map(str, words)])
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        with monkeypatch.context() as apart, pytest.raises(SystemExit) as ended:
            # the server would say that they are no settings
            for name in ("TOUCHLINE_TESTS", "TOUCHLINE_CHROMIUM"):
                apart.delenv(name, raising=False)
            main()
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return run


@pytest.fixture(scope="session")
def postgres():
    """A PostgreSQL server of our own; where none is installed, tests on it are skipped, except where all must run."""
    if programs() is None:
        if os.environ.get("TOUCHLINE_TESTS") == "all":
            pytest.fail("PostgreSQL is not installed: apt-get install postgresql")
        pytest.skip(
            "PostgreSQL is not installed (apt-get install postgresql): the store was not tried on it"
        )
    server = PostgresServer()
    yield server
    server.remove()


@pytest.fixture
def memory_path(tmp_path_factory):
    """A folder in memory where the system has such a disk, on the ordinary one elsewhere; removed afterwards."""
    shared = Path("/dev/shm")
    if not os.access(shared, os.W_OK):
        yield tmp_path_factory.mktemp("memory")
        return
    with tempfile.TemporaryDirectory(dir=shared, prefix="touchline-") as folder:
        yield Path(folder)


@pytest.fixture(params=["sqlite", "postgresql"])
def opener(request):
    """Opens stores, on SQLite and on PostgreSQL: opener(folder), and opener.again(store) after closing it."""
    return StoreOpener(
        request.getfixturevalue("postgres") if request.param == "postgresql" else None
    )
