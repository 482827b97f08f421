"""What is installed: the version, and where the files beside the code are."""

from pathlib import Path

__version__ = "0.1.0"

PACKAGE = Path(__file__).parents[1]


def shipped(folder: str) -> Path:
    """Return where configs/ or static/ is: at the top of a checkout, within the package in an installed wheel."""
    inside = PACKAGE / f"_{folder}"
    return inside if inside.is_dir() else PACKAGE.parents[1] / folder
