"""What all tests share: the module of small worlds is importable, and real data is found beside the project."""

import sys
from pathlib import Path

import pytest

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
