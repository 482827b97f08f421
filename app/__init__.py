"""Touchline: calibrates the cameras above a robot-soccer field, and says in millimetres how far to trust it."""

from pathlib import Path

__version__ = "0.1.0"


def shipped(folder: str) -> Path:
    """Return where configs/ or static/ is: beside app/ in a checkout, within it in an installed wheel."""
    inside = Path(__file__).parent / f"_{folder}"
    return inside if inside.is_dir() else Path(__file__).parents[1] / folder
