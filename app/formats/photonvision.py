"""PhotonVision: the JSON of one resolution's calibration, OpenCV's matrix and five or eight terms.

It keeps no pose, and passes over entries that it does not know: ours stands under "touchline".
"""

import json
from typing import Any, ClassVar

from app.core.records import Calibration
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile, size_of
from app.formats.metadata import About, about_from, about_json
from app.formats.numbers import entry, intrinsics, matrix, numbers, refuse
from app.formats.opencv_terms import LENSES, lengthened, shortened

MAX_BYTES = 4 << 20  # with pictures of the board inside
DOUBLE = 6  # OpenCV's CV_64F


class PhotonVision:
    NAME: ClassVar[str] = "photonvision"
    TITLE: ClassVar[str] = "PhotonVision JSON"
    MEDIA_TYPE: ClassVar[str] = "application/json"
    SUFFIX: ClassVar[str] = ".photon.json"
    HOLDS: ClassVar[str] = "Brown–Conrady lenses; no pose."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = LENSES
    SQUARE_PIXELS: ClassVar[bool] = False

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        camera = held.camera
        terms = list(shortened(camera.lens_terms))
        k = [camera.focal_px, 0.0, camera.centre_px[0], 0.0, camera.focal_px * camera.aspect, camera.centre_px[1],
             0.0, 0.0, 1.0]
        width, height = camera.image_size
        record = {"resolution": {"width": float(width), "height": float(height)},
                  "cameraIntrinsics": {"rows": 3, "cols": 3, "type": DOUBLE, "data": k},
                  "distCoeffs": {"rows": 1, "cols": len(terms), "type": DOUBLE, "data": terms},
                  "calobjectWarp": [], "observations": [], "calobjectSize": {"width": 0.0, "height": 0.0},
                  "calobjectSpacing": 0.0, "lensmodel": "LENSMODEL_OPENCV",
                  "touchline": about_json(calibration, held, pose=True)}
        return json.dumps(record, indent=1, allow_nan=False).encode()

    @staticmethod
    def recognises(data: bytes) -> bool:
        return data.lstrip()[:1] == b"{" and (b'"cameraIntrinsics"' in data or b'"cameraExtrinsics"' in data)

    @staticmethod
    def read(data: bytes) -> CameraFile:
        value = _json(data)
        resolution = entry(value, "resolution", "The file")
        size = size_of(entry(resolution, "width", "resolution"), entry(resolution, "height", "resolution"))
        focal, centre = intrinsics(matrix(entry(value, "cameraIntrinsics", "The file"), "cameraIntrinsics", 3, 3),
                                   "cameraIntrinsics")
        # older files call the terms "cameraExtrinsics"
        key = "distCoeffs" if "distCoeffs" in value else "cameraExtrinsics"
        terms = numbers(entry(entry(value, key, "The file"), "data", key), f"{key}.data", (4, 5, 8, 12, 14))
        about = about_from(value["touchline"]) if "touchline" in value else About()
        return CameraFile("photonvision", "brown-conrady", lengthened(terms, key), focal, centre, size, about,
                          about.pose if about.field is not None else None)


def _json(data: bytes) -> Any:
    if len(data) > MAX_BYTES:
        raise refuse(f"The file has {len(data)} bytes; we read at most {MAX_BYTES}.", "Give a shorter one.")
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise refuse(f"The file is no JSON: {str(error)[:99]}.", "Give the file that PhotonVision exported.") from None
