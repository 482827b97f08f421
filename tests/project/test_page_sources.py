"""The page's sources: they pass the type checker and the linter, and load nothing from elsewhere."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.npm import WORK, install_packages, npm
from tests.support.paths import NOT_OURS, ROOT, STATIC
from touchline.main import create_app
from touchline.settings import Settings

OURS = (".js", ".css", ".html", ".svg")
OWN = [
    p for p in STATIC.rglob("*") if p.is_file() and not NOT_OURS & {*p.parts} and p.suffix in OURS
]

# `import … from`, `export … from`, `import(…)` and a worker's `new URL(…, import.meta.url)`
IMPORTED = re.compile(
    r"""^(?:import|export)\b[^;"']*?["'](\.[^"']+)["']|\bimport\(\s*["'](\.[^"']+)["']"""
    r"""|\bnew URL\(\s*["'](\.[^"']+)["'],\s*import\.meta\.url""",
    re.MULTILINE,
)
DOC_COMMENT = re.compile(r"/\*\*.*?\*/", re.DOTALL)  # names types of other modules, loads none
LOWER = {"core": {"core"}, "ui": {"core", "ui"}}  # what scripts of a folder may import
MAX_LOOSE_SCRIPTS = 2  # main.js and one more

# A scheme and a host, or a protocol-relative address in quotes: what would be fetched from another machine.
ELSEWHERE = re.compile(r"""(?:https?|wss?)://[\w.-]+|["'(]//[\w-]+\.""")
NAMESPACES = {"http://www.w3.org"}  # names, never fetched


def import_graph(folder: Path) -> dict[str, set[str]]:
    """Return which of the folder's own scripts each script loads, by path within the folder."""
    folder = folder.resolve()
    return {
        source.relative_to(folder).as_posix(): {
            (source.parent / name).resolve().relative_to(folder).as_posix()
            for names in IMPORTED.findall(DOC_COMMENT.sub("", source.read_text(encoding="utf-8")))
            for name in names
            if name
        }
        for source in folder.rglob("*.js")
        if not NOT_OURS & {*source.relative_to(folder).parts}
    }


def reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    """Return every script that loading `start` loads, directly or not; `start` itself only where there is a circle."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        new = graph.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


@pytest.fixture(scope="session")
def checked_copy(tmp_path_factory):
    """The sources beside the libraries' types, as `npm ci` with the type checker lays them, and those of the API."""
    install_packages()
    copy = WORK / "static"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(STATIC, copy, ignore=shutil.ignore_patterns("vendor", ".vendor-*"))
    app = create_app(Settings(data=tmp_path_factory.mktemp("data")))
    with app.state.services.store:
        (WORK / "openapi.json").write_text(json.dumps(closed(app.openapi())))
    done = npm("run", "types")
    assert done.returncode == 0, done.stdout + done.stderr
    return copy


def closed(schema: Any) -> Any:
    """Return the API's description without entries that it does not name: a misspelt name is none of them."""
    if isinstance(schema, list):
        return [closed(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        key: closed(part)
        for key, part in schema.items()
        if not (key == "additionalProperties" and part is True and "properties" in schema)
    }


def checked(copy: Path) -> subprocess.CompletedProcess:
    return npm("run", "check", "--", "-p", str(copy))


def test_every_source_passes_the_type_checker(checked_copy):
    done = checked(checked_copy)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.long
def test_the_type_checker_would_notice_a_misspelt_name(checked_copy):
    misspelt = checked_copy / "misspelt.js"
    misspelt.write_text(
        'import { stageSize } from "./canvas/viewport.js";\nconsole.log(stageSize.value.widht);\n'
        '/** @type {import("./core/rest").SavedReport} */ let report;\nreport.rsm_px = null;\n'
    )
    done = checked(checked_copy)
    misspelt.unlink()
    assert done.returncode != 0
    assert "widht" in done.stdout and "rsm_px" in done.stdout


def passes(tool: str, *words: str) -> None:
    command = shutil.which(tool, path=str(Path(sys.executable).parent)) or shutil.which(tool)
    assert command, f"{tool} is missing: install the dev extra (pip install -e '.[dev]')"
    asked = [command, "--config", str(ROOT / f".{tool}rc.json"), *words, "static", "tests/page"]
    done = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_every_source_passes_the_linter():
    passes("oxlint")


def test_every_source_is_formatted():
    passes("oxfmt", "--check")


@pytest.mark.parametrize("source", OWN, ids=lambda p: str(p.relative_to(STATIC)))
def test_no_source_names_another_machine(source):
    found = [
        m for m in ELSEWHERE.findall(source.read_text(encoding="utf-8")) if m not in NAMESPACES
    ]
    assert not found


def test_the_page_loads_only_files_that_are_there():
    page = (STATIC / "index.html").read_text()
    mapped = json.loads(
        re.search(r'<script type="importmap">(.*?)</script>', page, re.DOTALL).group(1)
    )["imports"]
    wanted = [*re.findall(r'(?:href|src)="([^"]+)"', page), *mapped.values()]
    missing = [name for name in wanted if not (STATIC / name).is_file()]
    assert not missing, f"build the package first (pip install -e .): {missing}"


def test_every_import_is_a_file_beside_it_or_in_the_map():
    page = (STATIC / "index.html").read_text()
    for source in (p for p in OWN if p.suffix == ".js"):
        for name in re.findall(r'^import [^;]*?from "([^"]+)"', source.read_text(), re.MULTILINE):
            there = (
                (source.parent / name).is_file() if name.startswith(".") else f'"{name}":' in page
            )
            assert there, f"{source.name} imports {name}"


def test_no_script_imports_itself_over_others():
    graph = import_graph(STATIC)
    assert len(graph) > 100 and sum(map(len, graph.values())) > 500
    circles = sorted(name for name in graph if name in reachable(graph, name))
    assert not circles, {name: sorted(graph[name] & {*circles}) for name in circles}


def test_a_circle_would_be_noticed_however_it_is_imported(tmp_path):
    (tmp_path / "ui").mkdir()
    (tmp_path / "a.js").write_text(
        '/** @type {import("./d.js").D} */\nimport {\n  b,\n} from "./ui/b.js";\n'
    )
    (tmp_path / "ui" / "b.js").write_text('export const b = () => import("./c.js");\n')
    (tmp_path / "ui" / "c.js").write_text('new Worker(new URL("../a.js", import.meta.url));\n')
    (tmp_path / "d.js").write_text('export { b } from "./a.js";\n')
    graph = import_graph(tmp_path)
    assert [name for name in sorted(graph) if name in reachable(graph, name)] == [
        "a.js",
        "ui/b.js",
        "ui/c.js",
    ]


def test_few_scripts_stand_loose():
    assert len([*STATIC.glob("*.js"), *STATIC.glob("*.ts")]) <= MAX_LOOSE_SCRIPTS


def test_core_and_ui_import_nothing_above_them():
    graph = import_graph(STATIC)
    for name, imported in graph.items():
        folder = name.split("/")[0]
        assert folder in {"core", "ui", "canvas", "features", name}, name
        if folder in LOWER:
            assert not [other for other in imported if other.split("/")[0] not in LOWER[folder]], (
                name
            )


def test_no_canvas_and_no_layer_imports_a_panel():
    graph = import_graph(STATIC)
    drawn = [name for name in graph if name.startswith("canvas/") or "/layers/" in name]
    assert len(drawn) > 15 and any("/panels/" in name for name in graph)
    for name in drawn:
        assert not [other for other in reachable(graph, name) if "/panels/" in other], name


def test_the_lock_file_pins_every_byte_and_names_no_registry():
    lock = json.loads((STATIC / "package-lock.json").read_text())
    packages = {name: entry for name, entry in lock["packages"].items() if name}
    assert packages
    for name, entry in packages.items():
        assert entry.get("integrity", "").startswith("sha512-"), name
        assert "resolved" not in entry, name


def test_every_library_comes_with_its_licence():
    licences = STATIC / "vendor" / "licences"
    names = json.loads((STATIC / "package.json").read_text())["dependencies"]
    for name in names:
        short = name.split("/")[-1].removesuffix("-dist")
        assert (licences / f"{short}.txt").is_file(), name
