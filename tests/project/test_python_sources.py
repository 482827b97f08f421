"""The Python sources as the linter reads them; those of the page are in test_page_sources.py."""

import shutil
import subprocess
import sys
from pathlib import Path

from tests.support.paths import ROOT


def test_every_python_source_passes_the_linter():
    ruff = shutil.which("ruff", path=str(Path(sys.executable).parent)) or shutil.which("ruff")
    assert ruff, "ruff is missing: install the dev extra (pip install -e '.[dev]')"
    done = subprocess.run(
        [ruff, "check", "--no-cache", "--output-format", "concise", "app", "tests"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout
