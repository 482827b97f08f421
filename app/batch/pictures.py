"""Which pictures a folder holds, and where the clicks in each are written."""

from pathlib import Path

from app.sources.local.files import by_name
from app.sources.local.folder import SUFFIXES


def pictures_in(folder: Path) -> list[Path]:
    """List its pictures in the order of their names, 2 before 10. Links may lead nowhere: their rows will say so."""
    found = [path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and not path.name.startswith(".")
             and (path.is_file() or (path.is_symlink() and not path.exists()))]  # what is a pipe would never end
    return sorted(found, key=by_name)


def clicks_of(picture: Path, points: Path | None) -> Path | None:
    """Return the file of its clicks, or None: points itself, or in the folder points, or beside the picture.

    There it is called as the picture is: north.png.json, or north.json.
    """
    if points is not None and not points.is_dir():
        return points
    folder = points or picture.parent
    return next((path for path in (folder / f"{picture.name}.json", folder / f"{picture.stem}.json")
                 if path.is_file()), None)
