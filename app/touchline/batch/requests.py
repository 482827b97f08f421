"""What each picture's job is given, looked up and checked before it takes a worker's time.

Which pictures a folder holds, and where the clicks in each are written.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from touchline import __version__
from touchline.batch.table import Row, row_of
from touchline.batch.tasks import run_calibration, run_verification
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, ObservationJson, observations_from_json
from touchline.images import ImageLimits, screen
from touchline.sources.local.files import by_name
from touchline.sources.local.folder import SUFFIXES
from touchline.workflows.calibration_request import CalibrationRequest

ReadFile = Callable[[Path], bytes]
# picture, its size, sha256 of its bytes, its clicks
RequestOf = Callable[[Path, ImageSize, str, Path], CalibrationRequest]


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


@dataclass(frozen=True)
class BatchRequest:
    """One picture's job. inputs: a hash of all that its row rests on besides the picture."""

    picture: str
    sha256: str
    inputs: str
    run: Callable[..., Any]
    spec: dict[str, Any]


@dataclass(frozen=True, eq=False)
class BatchPlan:
    """What is done with each picture: with a calibration it is verified; else task_of makes what is to be fitted.

    read: a file's bytes. read_points: what a file of clicks says. before: rows of an earlier run.
    """

    read: ReadFile
    read_points: Callable[[Path], Mapping[str, Any]]
    task_of: RequestOf
    points: Path | None = None
    calibration: Calibration | None = None
    before: tuple[Row, ...] = ()

    def requests(self, pictures: list[Path]) -> Iterator[BatchRequest | Row]:
        """Yield each picture's request; or its row, where there is one already or nothing can be done."""
        known = {(row["sha256"], row["inputs"]): row for row in self.before if row["inputs"]}
        for path in pictures:
            head: dict[str, Any] = {"picture": path.name}
            try:
                data = self.read(path)
                head["sha256"] = hashlib.sha256(data).hexdigest()
                declared = screen(data, ImageLimits())
                request = self._request(path, ImageSize(declared.width, declared.height), head["sha256"])
            except TouchlineError as error:
                yield row_of(**head, verdict="failed", problem=error.what, fix=error.fix)
                continue
            row = known.get((request.sha256, request.inputs))
            yield request if row is None else {**row, "picture": path.name}

    def _request(self, path: Path, size: ImageSize, sha256: str) -> BatchRequest:
        clicks = clicks_of(path, self.points)
        if self.calibration is not None:
            seen = self._observations(clicks, size)
            run, rest = run_verification, {"calibration": self.calibration.to_json(), "observations": seen}
        elif clicks is None:
            raise BadInput(f"There are no points for {path.name}.", f"Save them as {path.stem}.json in the same "
                           "folder, or give their file or folder with --points.", reason="no-clicks")
        else:
            run, rest = run_calibration, {"task": self.task_of(path, size, sha256, clicks).to_json()}
        text = json.dumps([__version__, rest], sort_keys=True, allow_nan=False)
        place = {"name": path.name, "path": str(path.resolve()), "sha256": sha256}
        return BatchRequest(path.name, sha256, hashlib.sha256(text.encode()).hexdigest()[:16], run,
                            {**rest, "picture": place})

    def _observations(self, clicks: Path | None, size: ImageSize) -> list[ObservationJson]:
        """Return the observations of a file that must be of the calibration's field and the picture's size."""
        known = self.calibration
        if clicks is None or known is None:
            return []
        given = self.read_points(clicks)
        for what, is_so in (("field", known.field["name"]), ("region", known.region)):
            if given.get(what, is_so) != is_so:
                raise Conflict(f"{clicks.name} has points on the {what} {given[what]}; the calibration is for {is_so}.",
                               "Use points on the field and region of the calibration.", reason="other-field")
        if "image_size" in given and ImageSize.of(given["image_size"]) != size:
            raise Conflict(f"{clicks.name} is for an image of {given['image_size']}; this image has {size.width} × "
                           f"{size.height} px.", "Use the points of this image.", reason="size-mismatch")
        return [observation.to_json() for observation in observations_from_json(given["observations"])]
