"""PhotonVision: the JSON of one resolution's calibration, OpenCV's matrix and five or eight terms.

It keeps no pose, and passes over entries that it does not know: ours stands under "touchline".
"""

import json
from typing import Any

from touchline.core.records import Calibration
from touchline.formats import Format
from touchline.formats.approximation import (
    ExportCamera,
    Metadata,
    metadata_from_json,
    metadata_json,
)
from touchline.formats.camera_file import (
    LENSES,
    CameraFile,
    checked_size,
    lens_from_terms,
    lens_terms,
    matrix_of,
    read_intrinsics,
)
from touchline.formats.numbers import format_error, numbers, require

MAX_BYTES = 4 << 20  # with pictures of the board inside
DOUBLE = 6  # OpenCV's CV_64F


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    terms = list(lens_terms(camera))
    width, height = camera.image_size
    record = {
        "resolution": {"width": float(width), "height": float(height)},
        "cameraIntrinsics": {"rows": 3, "cols": 3, "type": DOUBLE, "data": list(matrix_of(camera))},
        "distCoeffs": {"rows": 1, "cols": len(terms), "type": DOUBLE, "data": terms},
        "calobjectWarp": [],
        "observations": [],
        "calobjectSize": {"width": 0.0, "height": 0.0},
        "calobjectSpacing": 0.0,
        "lensmodel": "LENSMODEL_OPENCV",
        "touchline": metadata_json(calibration, export, pose=True),
    }
    return json.dumps(record, indent=1, allow_nan=False).encode()


def read(data: bytes) -> CameraFile:
    value = _json(data)
    resolution = require(value, "resolution", "The file")
    size = checked_size(
        require(resolution, "width", "resolution"), require(resolution, "height", "resolution")
    )
    focal, centre = read_intrinsics(
        require(value, "cameraIntrinsics", "The file"), "cameraIntrinsics"
    )
    # older files call the terms "cameraExtrinsics"
    key = "distCoeffs" if "distCoeffs" in value else "cameraExtrinsics"
    terms = numbers(
        require(require(value, key, "The file"), "data", key), f"{key}.data", (4, 5, 8, 12, 14)
    )
    metadata = metadata_from_json(value["touchline"]) if "touchline" in value else Metadata()
    return CameraFile(
        "photonvision",
        *lens_from_terms(terms, key),
        focal,
        centre,
        size,
        metadata,
        metadata.field_pose,
    )


def _json(data: bytes) -> Any:
    if len(data) > MAX_BYTES:
        raise format_error(
            f"The file has {len(data)} bytes. The limit is {MAX_BYTES}.", "Use a shorter file."
        )
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise format_error(
            f"The file is not valid JSON: {str(error)[:99]}.",
            "Use the file that PhotonVision exported.",
        ) from None


FORMAT = Format(
    "PhotonVision JSON",
    "application/json",
    ".photon.json",
    "Brown–Conrady lenses; no pose.",
    write,
    read,
    recognises=lambda data: (
        data.lstrip()[:1] == b"{"
        and (b'"cameraIntrinsics"' in data or b'"cameraExtrinsics"' in data)
    ),
    lenses=LENSES,
)
