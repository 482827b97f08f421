"""The Python sources as the linter reads and the formatter writes them; those of the page: test_page_sources.py."""

import shutil
import subprocess
import sys
from pathlib import Path

from tests.support.paths import ROOT


def passes(*words: str) -> None:
    ruff = shutil.which("ruff", path=str(Path(sys.executable).parent)) or shutil.which("ruff")
    assert ruff, "ruff is missing: install the dev extra (pip install -e '.[dev]')"
    asked = [ruff, *words, "--no-cache", "app", "tests"]
    done = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_every_python_source_passes_the_linter():
    passes("check", "--output-format", "concise")


def test_every_python_source_is_formatted():
    passes("format", "--check")
