"""The structure of app/: layers, import circles, what the computing packages may use, sizes and names."""

import pytest

from tests.support.import_graph import circles, imported_names, python_modules
from tests.support.paths import ROOT

MODULES = python_modules(ROOT / "app")

COMPUTING = ("core", "ssl_protocol", "models", "vision", "fitting", "imaging", "evaluate")
# A clock, a file, a socket, a thread, a process, SQL or the web.
SIDE_EFFECTS = {"time", "datetime", "os", "pathlib", "io", "shutil", "tempfile", "socket", "threading", "subprocess",
                "multiprocessing", "concurrent", "asyncio", "logging", "sqlite3", "sqlalchemy", "fastapi", "starlette",
                "uvicorn", "pydantic", "requests", "urllib", "http", "yaml", "random", "secrets", "glob"}
PARSERS = {("app.core.strict_yaml", "yaml")}  # parses text that is at hand; it opens nothing

MAX_LOOSE = {"app/*.py": 3, "tests/*.py": 3}


def test_no_import_is_excepted_from_the_layers():
    assert "ignore_imports" not in (ROOT / "pyproject.toml").read_text()


def test_a_circle_would_be_found():
    assert circles({1: {2}, 2: {3}, 3: {2}, 4: {1, 4}}) == [[2, 3]]


@pytest.mark.parametrize("package", COMPUTING)
def test_a_computing_package_uses_no_clock_file_socket_thread_or_web(package):
    found = [f"{module}:{line} imports {name}" for module, tree in MODULES.items()
             if module.startswith(f"app.{package}.") or module == f"app.{package}"
             for name, line in imported_names(tree)
             if (top := name.split(".")[0]) in SIDE_EFFECTS and (module, top) not in PARSERS]
    assert found == []


@pytest.mark.parametrize("pattern", MAX_LOOSE)
def test_few_files_lie_loose(pattern):
    assert len(list(ROOT.glob(pattern))) <= MAX_LOOSE[pattern]
