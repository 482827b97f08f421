"""A capability that has its folder: which of its files may know what, and that all that is its own has its name.

It stands outside the layers of pyproject.toml: nothing imports it, capabilities.py names what it adds.
"""

from collections.abc import Iterator, Mapping

import pytest

from tests.support.import_graph import imported_names, python_modules
from tests.support.owners import OWNERS
from tests.support.paths import PACKAGE, ROOT

FOLDERS = [name for name in OWNERS if (PACKAGE / name / "routes.py").exists()]
# What the files of a folder may know, by their name; all others compute.
WEB_AND_SHELL = {"touchline.api", "touchline.cli", "fastapi", "starlette", "typer"}
STATE = {
    "touchline.services",
    "touchline.store",
    "touchline.live",
    "touchline.jobs",
    "anyio",
    "asyncio",
    "threading",
    "time",
    "datetime",
    "pathlib",
    "os",
    "logging",
}
MAY_KNOW = {
    "routes": WEB_AND_SHELL | STATE,
    "commands": WEB_AND_SHELL | STATE,
    "service": STATE,
    "live": STATE,
    "store": STATE,
}


def trespasses(imports: Mapping[str, set[str]]) -> Iterator[str]:
    """Yield each import that a file of a folder may not have. imports: full dotted names, by the module's own name."""
    for module, names in imports.items():
        may_not = (WEB_AND_SHELL | STATE) - MAY_KNOW.get(module.rpartition(".")[2], set())
        for name in sorted(names):
            if any(name == known or name.startswith(f"{known}.") for known in may_not):
                yield f"{module} imports {name}"


@pytest.mark.parametrize("folder", FOLDERS)
def test_only_its_routes_and_commands_know_the_web_and_only_its_service_and_store_what_is_saved(
    folder,
):
    assert [
        *trespasses(
            {
                module: {name for name, _ in imported_names(tree)}
                for module, tree in python_modules(PACKAGE).items()
                if module.startswith(f"touchline.{folder}.")
            }
        )
    ] == []


def test_a_trespass_is_found():
    web, store, clock = (
        "fastapi.APIRouter",
        "touchline.store.repository.utc_now",
        "datetime.datetime",
    )
    assert [
        *trespasses(
            {
                "touchline.rigs.routes": {web, store},
                "touchline.rigs.service": {web, store},
                "touchline.rigs.check": {store, clock, "touchline.core.errors.BadInput"},
            }
        )
    ] == [
        f"touchline.rigs.service imports {web}",
        f"touchline.rigs.check imports {clock}",
        f"touchline.rigs.check imports {store}",
    ]


@pytest.mark.parametrize("folder", FOLDERS)
def test_its_tests_its_page_and_its_manual_have_its_name(folder):
    for place in (
        f"tests/unit/{folder}",
        f"tests/api/test_rest_{folder}.py",
        f"static/features/{folder}",
        f"static/help/{folder}.md",
    ):
        assert (ROOT / place).exists(), place


def test_there_is_one():
    assert "rigs" in FOLDERS
