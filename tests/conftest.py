"""What all tests share: small worlds to import, real data from beside the project, and the shell."""

import io
import sys
from pathlib import Path

import pytest

from app.cli import main

sys.path.insert(0, str(Path(__file__).parent))

DATA = Path(__file__).parents[2] / "shared" / "data"


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
        monkeypatch.setattr(sys, "stdin", io.StringIO(stdin))
        with pytest.raises(SystemExit) as ended:
            main()
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return run
