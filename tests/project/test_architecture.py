"""The structure of app/: layers, import circles, what the computing packages may use, sizes and names."""

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from tests.support.import_graph import circles, imported_names, python_graph, python_modules
from tests.support.owners import ALLOWED, owner
from tests.support.paths import NOT_OURS, PACKAGE, ROOT, STATIC
from touchline.capabilities import CAPABILITIES, commands

SCRIPTS = [path for path in sorted(STATIC.rglob("*.js")) if not NOT_OURS & {*path.parts}]

COMPUTING = ("core", "ssl_protocol", "models", "vision", "fitting", "imaging", "evaluate")
# A clock, a file, a socket, a thread, a process, SQL or the web.
SIDE_EFFECTS = {
    "time",
    "datetime",
    "os",
    "pathlib",
    "io",
    "shutil",
    "tempfile",
    "socket",
    "threading",
    "subprocess",
    "multiprocessing",
    "concurrent",
    "asyncio",
    "logging",
    "sqlite3",
    "sqlalchemy",
    "fastapi",
    "starlette",
    "uvicorn",
    "pydantic",
    "requests",
    "urllib",
    "http",
    "yaml",
    "random",
    "secrets",
    "glob",
}
# These parse what is at hand; they open nothing.
PARSERS = {("touchline.core.strict_yaml", "yaml"), ("touchline.core.json_values", "pydantic")}

MAX_SCRIPT_COLUMNS = 120
CATALOGUES = STATIC / "core" / "words"  # one message a line, as long as its sentence
MAX_LOOSE = {"app/touchline/[!_]*.py": 3, "tests/*.py": 2}  # main, settings, capabilities

# Each member of these families may name its own Item, Lens or Row.
FAMILIES = (
    "touchline.api.schemas.",
    "touchline.client.answers",
    "touchline.sources.sim.",
    "touchline.store.migrations.",
)
PRIVATE_FUNCTIONS = {"told", "tell", "heard", "kept", "asked", "held", "spoken", "deed"}
PRIVATE_CLASSES = {
    "Ear",
    "Hung",
    "Lying",
    "Standing",
    "Told",
    "Heard",
    "Sighted",
    "Theatre",
    "Room",
    "Wanted",
    "Shown",
    "Seen",
    "Asked",
}


@cache
def modules() -> dict[str, ast.Module]:
    return python_modules(PACKAGE)


def definitions(kind: type | tuple[type, ...]):
    """Each (module, node) of that kind in app/, inside classes and functions too."""
    return (
        (module, node)
        for module, tree in modules().items()
        for node in ast.walk(tree)
        if isinstance(node, kind)
    )


def test_packages_import_only_packages_below_them():
    """The layers are in pyproject.toml."""
    command = shutil.which("lint-imports", path=str(Path(sys.executable).parent)) or shutil.which(
        "lint-imports"
    )
    assert command, "import-linter is missing: install the dev extra (pip install -e '.[dev]')"
    done = subprocess.run([command, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_package_outside_the_layers_is_a_capability_that_none_of_them_imports():
    layers = {
        name
        for contract in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"][
            "importlinter"
        ]["contracts"]
        for name in contract["layers"]
    }
    found = {module.split(".")[1] for module in modules() if "." in module} - layers
    named = {
        target.split(".")[1]
        for one in CAPABILITIES.values()
        for target in (
            *one.routes,
            *one.jobs.values(),
            *one.savers.values(),
            *one.camera_parts,
            *one.claims,
            *one.site_claims,
        )
    }
    assert found <= named
    assert [
        f"{module} imports {name}"
        for module, imported in python_graph(modules()).items()
        for name in imported
        if name.split(".")[1:2] != module.split(".")[1:2]
        and {*name.split(".")[1:2]} & found
        and (owner(module), owner(name)) not in ALLOWED
    ] == []


def test_no_import_is_excepted_from_the_layers():
    assert "ignore_imports" not in (ROOT / "pyproject.toml").read_text()


def test_no_modules_import_each_other_in_a_circle():
    assert circles(python_graph(modules())) == []


def test_only_the_commands_that_serve_import_the_server():
    """At the head of a module, by way of any other: it takes a second of every start."""
    heads = {
        module: ast.Module(
            [one for one in tree.body if isinstance(one, ast.Import | ast.ImportFrom)], []
        )
        for module, tree in modules().items()
    }
    graph = python_graph(heads)

    def imported(module: str) -> set[str]:
        found, waiting = set(), [module]
        while waiting:
            if (one := waiting.pop()) not in found:
                found.add(one)
                waiting += graph[one]
        return found

    serving = {
        name
        for name, (target, _) in commands().items()
        if "touchline.main" in imported(target.partition(":")[0])
    }
    assert serving == {"serve", "demo"}


def test_no_module_imports_the_package_that_scripts_import():
    """It names the client, which stands on everything: whoever imported it would stand on everything, too."""
    members = {module.split(".")[1] for module in modules() if "." in module}
    found = [
        f"{module}:{line} {name}"
        for module, tree in modules().items()
        if module != "touchline"
        for name, line in imported_names(tree)
        if name.split(".")[0] == "touchline" and name.split(".")[1] not in members
    ]
    assert found == []


def test_a_circle_would_be_found():
    assert circles({1: {2}, 2: {3}, 3: {2}, 4: {1, 4}}) == [[2, 3]]


@pytest.mark.parametrize("package", COMPUTING)
def test_a_computing_package_uses_no_clock_file_socket_thread_or_web(package):
    found = [
        f"{module}:{line} imports {name}"
        for module, tree in modules().items()
        if module.startswith(f"touchline.{package}.") or module == f"touchline.{package}"
        for name, line in imported_names(tree)
        if (top := name.split(".")[0]) in SIDE_EFFECTS and (module, top) not in PARSERS
    ]
    assert found == []


@pytest.mark.parametrize("pattern", MAX_LOOSE)
def test_few_files_lie_loose(pattern):
    assert len(list(ROOT.glob(pattern))) <= MAX_LOOSE[pattern]


def test_no_line_of_a_script_is_too_long():
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in SCRIPTS
        if CATALOGUES not in path.parents
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > MAX_SCRIPT_COLUMNS
    ]
    assert found == []


def test_no_model_is_asked_for_a_contract_by_an_attribute():
    """What projects is a RayModel: isinstance says so, and the type checker understands it."""
    found = [
        f"{module}:{call.lineno}"
        for module, call in definitions(ast.Call)
        if isinstance(call.func, ast.Name)
        and call.func.id in ("hasattr", "getattr")
        and len(call.args) > 1
        and isinstance(call.args[1], ast.Constant)
        and "project" in str(call.args[1].value)
    ]
    assert found == []


def test_nothing_waits_in_a_way_that_swallows_a_cancellation():
    """Before Python 3.12, asyncio.wait_for returns what comes in the moment of a cancellation, which is then lost."""
    found = [
        f"{module}:{call.lineno}"
        for module, call in definitions(ast.Call)
        if isinstance(call.func, ast.Attribute)
        and call.func.attr == "wait_for"
        and isinstance(call.func.value, ast.Name)
        and call.func.value.id == "asyncio"
    ]
    assert found == [], "use async with asyncio.timeout(…)"


def test_no_public_class_name_is_defined_twice():
    places = defaultdict(list)
    for module, node in definitions(ast.ClassDef):
        if not node.name.startswith("_") and not module.startswith(FAMILIES):
            places[node.name].append(f"{module}:{node.lineno}")
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_functions_and_classes_have_the_names_of_the_field():
    functions = definitions((ast.FunctionDef, ast.AsyncFunctionDef))
    found = [
        f"{module}:{node.lineno} {node.name}"
        for module, node in functions
        if node.name.strip("_") in PRIVATE_FUNCTIONS
    ]
    found += [
        f"{module}:{node.lineno} {node.name}"
        for module, node in definitions(ast.ClassDef)
        if node.name.strip("_") in PRIVATE_CLASSES
    ]
    assert found == []


def test_limits_begin_with_min_and_max():
    found = [
        f"{module}:{node.lineno} {node.id}"
        for module, node in definitions(ast.Name)
        if isinstance(node.ctx, ast.Store) and node.id.lstrip("_").startswith(("MOST_", "LEAST_"))
    ]
    assert found == []


def test_docstrings_name_files_that_are_there():
    """NAME.py stands for the one that somebody is to write."""
    known = {path.name for path in (*PACKAGE.rglob("*.py"), *(ROOT / "tests").rglob("*.py"))} | {
        "NAME.py"
    }
    found = [
        f"{module}: {name}"
        for module, tree in modules().items()
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        for name in re.findall(r"\b\w+\.py\b", ast.get_docstring(node) or "")
        if name not in known
    ]
    assert found == []
