"""Points, calibrations and pictures: from files that anybody may have written, and to files that are whole."""

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from touchline.cli.console import FileTrouble
from touchline.core.errors import BadInput
from touchline.core.geometry import Points, as_points
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Frame
from touchline.fitting.ray_camera.lens_prior import DistortionEstimate
from touchline.formats import json_file
from touchline.images import ImageDecoder, ImageLimits, encode, frame_from_bytes
from touchline.models.intrinsics import Intrinsics
from touchline.store.files import write_atomically

POINTS_KEYS = (
    "observations",
    "field",
    "region",
    "rotate",
    "model",
    "options",
    "image_size",
    "note",
)
POINTS_FORM = 'Use a list of observations, or {"field": …, "region": …, "observations": […]}.'
LENS_FORMAT = "touchline-lens"
MAX_JSON_BYTES = 16 << 20
MAX_POINT_BYTES = 256 << 20


def read_bytes(path: Path, max_bytes: int = ImageLimits().max_bytes) -> bytes:
    """Read a whole file of at most so many bytes."""
    try:
        with path.open("rb") as file:
            data = file.read(max_bytes + 1)
    except OSError as error:
        raise FileTrouble(
            f"{path} cannot be read: {error.strerror}.", "Check the path and its permissions."
        ) from None
    if len(data) > max_bytes:
        raise BadInput(
            f"{path} has more than {max_bytes / 1e6:.4g} MB.",
            "Use a smaller file.",
            reason="too-large",
        )
    return data


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole or not at all, behind a symbolic link as well; into a device or a FIFO as it is."""
    try:
        if path.exists() and (
            not path.is_file() or path.is_relative_to("/dev") or path.is_relative_to("/proc")
        ):
            # /dev/stdout may be a file that the shell has open
            with path.open("wb", buffering=0) as file:
                rest = memoryview(data)
                while rest:
                    rest = rest[file.write(rest) :]
        else:
            write_atomically(path.resolve(), data)
    except OSError as error:
        raise FileTrouble(
            f"{path} cannot be written: {error.strerror}.",
            "Check the folder, its permissions and the free disk space.",
        ) from None


def read_picture(path: Path) -> Frame:
    return frame_from_bytes(read_bytes(path))


@contextmanager
def decoded(paths: Sequence[Path]) -> Iterator[list[tuple[str, Callable[[], Frame]]]]:
    """Name each picture and how to read it, one at a time, while a child runs that decodes them."""
    with ImageDecoder(workers=1) as decoder:

        def read(path: Path) -> Frame:
            return decoder.frame_from_bytes(read_bytes(path))

        yield [(path.name, partial(read, path)) for path in paths]


def write_picture(path: Path, pixels: Any) -> None:
    """PNG or JPEG, by the name's ending."""
    format = {".png": "png", ".jpg": "jpg", ".jpeg": "jpg"}.get(path.suffix.lower())
    if format is None:
        raise BadInput(
            f"The image format of {path.name} is unknown.",
            "Use a name that ends with .png or .jpg.",
            reason="unknown-image-format",
        )
    write_bytes(path, encode(pixels, format, quality=95))


def read_calibration(path: Path) -> Calibration:
    return json_file.read(read_bytes(path, MAX_JSON_BYTES))


def write_calibration(path: Path, calibration: Calibration) -> None:
    write_bytes(path, json_file.write(calibration))


def read_lens_option(path: Path) -> dict[str, Any]:
    """Read the lens of a file that board, motion or calibrate wrote, as a fit's option."""
    record = read_lens_record(path)
    if record is None:
        return read_calibration(path).lens_option()
    given = record.get("lens")
    # from straight lines: no focal length
    if isinstance(given, dict) and "unit" in given:
        bent = DistortionEstimate.from_json(given)
        return {"name": bent.distortion.name, "lens": bent.to_json()}
    lens = Intrinsics.from_json(given)
    return {"name": lens.model, "lens": lens.to_json()}


def read_lens_record(path: Path) -> JsonObject | None:
    """Read a file that write_lens wrote; None for any other JSON."""
    value = strict_json(read_bytes(path, MAX_JSON_BYTES), str(path))
    is_lens = isinstance(value, dict) and value.get("format") == LENS_FORMAT
    return value if is_lens else None


def write_lens(path: Path, found: Mapping[str, Any]) -> None:
    """Write a lens as a board calibration answered it."""
    record = {"format": LENS_FORMAT, "format_version": 1, **found}
    write_bytes(path, json.dumps(record, indent=1, allow_nan=False, ensure_ascii=False).encode())


def read_points_file(path: Path) -> dict[str, Any]:
    """{"observations": […]} and whatever else of POINTS_KEYS the file says."""
    value = strict_json(read_bytes(path, MAX_JSON_BYTES), str(path))
    if isinstance(value, list):
        value = {"observations": value}
    if not isinstance(value, Mapping) or "observations" not in value:
        raise BadInput(f"{path} contains no observations.", POINTS_FORM, reason="bad-points-file")
    for key in value:
        if key not in POINTS_KEYS:
            raise BadInput(
                f"{path} has an unknown entry {key!r}.",
                f"Known entries: {', '.join(POINTS_KEYS)}.",
                reason="bad-points-file",
            )
    return dict(value)


def strict_json(data: bytes | str, name: str) -> Any:
    """JSON as the standard has it: no NaN, no Infinity."""

    def refuse(constant: str) -> Any:
        raise BadInput(
            f"{name} contains {constant}.",
            "Remove or correct that point.",
            reason="non-finite-number",
        )

    try:
        return json.loads(data, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise BadInput(
            f"{name} is not JSON: {error}.", "Correct the file.", reason="bad-json"
        ) from None


def json_or_text(word: str) -> Any:
    """Read the VALUE of NAME=VALUE: JSON, or else a text."""
    try:
        return json.loads(word)
    except (ValueError, RecursionError):
        return word


def points_from_text(text: str) -> Points:
    """(n, 2) points from JSON ([[x, y], …]) or from lines of x,y."""
    if text.lstrip().startswith(("[", "{")):
        value = strict_json(text, "The input")
        return as_points(
            value["points"] if isinstance(value, dict) and "points" in value else value
        ).reshape(-1, 2)
    rows = [row for row in csv.reader(text.splitlines(), skipinitialspace=True) if row]
    return points_from_pairs([",".join(row) for row in rows])


def points_from_pairs(pairs: list[str]) -> Points:
    """(n, 2) points from "x,y" words."""
    points = []
    for pair in pairs:
        try:
            x, y = (float(part) for part in pair.split(","))
        except ValueError:
            raise BadInput(
                f"{pair!r} is not a point.",
                "Write points as x,y with a decimal point, such as 320.5,240.",
                reason="bad-points",
            ) from None
        points.append((x, y))
    return as_points(points)
