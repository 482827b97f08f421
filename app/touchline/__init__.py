"""Touchline: calibrates the cameras above a robot-soccer field, and says in millimetres how far to trust it."""

from pathlib import Path

__version__ = "0.1.0"


def shipped(folder: str) -> Path:
    """Return where configs/ or static/ is: at the top of a checkout, within the package in an installed wheel."""
    inside = Path(__file__).parent / f"_{folder}"
    return inside if inside.is_dir() else Path(__file__).parents[2] / folder
