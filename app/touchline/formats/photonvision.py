"""PhotonVision: the JSON of one resolution's calibration, OpenCV's matrix and five or eight terms.

It keeps no pose, and passes over entries that it does not know: ours stands under "touchline".
"""

import json

from touchline.core.records import Calibration
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, metadata_json

DOUBLE = 6  # OpenCV's CV_64F


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    terms = list(camera_file.lens_terms(camera))
    width, height = camera.image_size
    record = {
        "resolution": {"width": float(width), "height": float(height)},
        "cameraIntrinsics": {
            "rows": 3,
            "cols": 3,
            "type": DOUBLE,
            "data": list(camera_file.matrix_of(camera)),
        },
        "distCoeffs": {"rows": 1, "cols": len(terms), "type": DOUBLE, "data": terms},
        "calobjectWarp": [],
        "observations": [],
        "calobjectSize": {"width": 0.0, "height": 0.0},
        "calobjectSpacing": 0.0,
        "lensmodel": "LENSMODEL_OPENCV",
        "touchline": metadata_json(calibration, export, pose=True),
    }
    return json.dumps(record, indent=1, allow_nan=False).encode()


FORMAT = Format(
    "PhotonVision JSON",
    "application/json",
    ".photon.json",
    "Brown–Conrady lenses; no pose.",
    write,
    camera_file.read,
    lenses=camera_file.LENSES,
)
