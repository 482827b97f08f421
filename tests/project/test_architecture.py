"""The architecture page: which module stands on which floor. Imports only go down, never sideways into a neighbour."""

import ast
from pathlib import Path

import pytest

from tests.support.paths import ROOT

FLOORS = [
    ["errors", "geometry", "records", "registry", "field", "field_reader", "board", "wording", "cv",
     "strict_yaml", "wire", "options", "detections", "colour_profile", "butterfly"],   # 0 words
    ["models", "vision"],                                                          # 1 numbers
    ["correction", "evaluate", "heatmap"],                                                    # 2 numbers about models
    ["sources", "exports", "images", "store", "publish", "child_line"],                          # 3 edges
    ["pipeline", "board_pipeline", "plumb_pipeline", "pair_pipeline", "task", "board_task", "plumb_task", "jobs",
     "live", "settings", "interchange", "report", "batch", "rig_pipeline", "rig_stitch",
     "auto_pipeline", "auto_task", "check_pipeline", "register_task", "motion_pipeline", "motion_task", "space",
     "detection_pipeline", "corrected_sight"],                                                           # 4 work
    ["api", "scene", "cli", "serving"],                                            # 5 doors
    ["main"],                                                                      # 6 wiring
]
# Words may use each other; a family's parts are one room; a door may open the whole (the command line starts the
# server); settings are read by whoever wires.
SIDEWAYS = {("cli", "main"), ("task", "pipeline"), ("auto_pipeline", "pipeline"), ("auto_task", "auto_pipeline"),
            ("auto_task", "pipeline"), ("auto_task", "task"), ("check_pipeline", "auto_pipeline"),
            ("check_pipeline", "auto_task"), ("check_pipeline", "pipeline"),
            ("board_task", "board_pipeline"), ("board_task", "pipeline"), ("plumb_task", "plumb_pipeline"),
            ("live", "pipeline"), ("live", "motion_pipeline"), ("live", "detection_pipeline"),
            ("detection_pipeline", "corrected_sight"),
            ("interchange", "task"), ("report", "pipeline"), ("rig_pipeline", "pipeline"),
            ("rig_pipeline", "pair_pipeline"), ("rig_pipeline", "task"), ("publish", "exports"),
            ("register_task", "pipeline"), ("register_task", "auto_pipeline"), ("register_task", "task"),
            ("motion_task", "motion_pipeline"), ("motion_task", "plumb_pipeline"), ("motion_task", "pipeline"),
            ("motion_task", "task"),
            ("motion_pipeline", "plumb_pipeline"), ("batch", "task"), ("batch", "plumb_pipeline"), ("batch", "jobs"),
            ("batch", "report"),
            ("space", "pipeline"), ("api", "scene"), ("cli", "scene")}
PURE = 3  # floors below this compute: no clock, file, socket, thread, process or web
IMPURE = {"time", "datetime", "os", "pathlib", "io", "shutil", "tempfile", "socket", "threading", "subprocess",
          "multiprocessing", "concurrent", "asyncio", "logging", "sqlite3", "fastapi", "starlette", "uvicorn",
          "pydantic", "requests", "urllib", "http", "yaml", "random", "secrets", "glob"}

ALLOWED = {("strict_yaml", "yaml")}  # a parser of text that is at hand; it opens nothing

FLOOR_OF = {name: floor for floor, names in enumerate(FLOORS) for name in names}
FILES = sorted((ROOT / "app").rglob("*.py"))


def room(path: Path) -> str | None:
    parts = path.relative_to(ROOT / "app").with_suffix("").parts
    return None if parts == ("__init__",) else parts[0]


def imported(path: Path) -> list[tuple[str, int]]:
    """(dotted name, line) of everything a file imports, inside functions too."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno} imports relatively; write the whole name"
            base = node.module or ""
            found += [(f"{base}.{alias.name}" if base == "app" else base, node.lineno) for alias in node.names]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_only_go_down(path):
    here = room(path)
    if here is None:
        return
    assert here in FLOOR_OF, f"{here} stands on no floor; give it one in this file"
    for name, line in imported(path):
        parts = name.split(".")
        where = f"{path.relative_to(ROOT)}:{line}"
        if parts[0] == "app" and len(parts) > 1 and parts[1] in FLOOR_OF and parts[1] != here:
            down = FLOOR_OF[parts[1]] < FLOOR_OF[here] or FLOOR_OF[here] == FLOOR_OF[parts[1]] == 0
            wiring = (here, parts[1]) in SIDEWAYS
            assert down or wiring, f"{where} imports {name}, which does not stand below {here}"
        if FLOOR_OF[here] < PURE:
            pure = parts[0] not in IMPURE or (here, parts[0]) in ALLOWED
            assert pure, f"{where} imports {parts[0]}; floors 0-2 only compute"


def test_every_room_has_its_files():
    """A floor plan that names rooms nobody enters any more is out of date only on purpose: later rooms may be empty."""
    rooms = {room(path) for path in FILES} - {None}
    assert rooms <= set(FLOOR_OF)
    assert {"errors", "geometry", "records", "registry", "field", "models", "correction", "evaluate"} <= rooms
