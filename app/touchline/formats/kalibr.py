"""Kalibr: a camchain with one camera, pinhole with radtan (k1 k2 p1 p2) or equidistant (the four of a fisheye).

The chain's transformations are between cameras and to an IMU, none to a field: our pose stands in a comment.
"""

import re

from touchline.core.records import Calibration
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header
from touchline.formats.numbers import format_list
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    fisheye = camera.NAME == "fisheye"
    topic = re.sub(r"[^A-Za-z0-9_]", "_", calibration.camera or "camera")
    lines = [
        "cam0:",
        "  camera_model: pinhole",
        f"  intrinsics: {format_list(camera_file.intrinsics_of(camera))}",
        f"  distortion_model: {'equidistant' if fisheye else 'radtan'}",
        f"  distortion_coeffs: {format_list(camera.lens_terms[:4])}",
        f"  resolution: [{camera.image_size.width}, {camera.image_size.height}]",
        f"  rostopic: /{topic}/image_raw",
    ]
    return (header(calibration, export, pose=True) + "\n".join(lines) + "\n").encode()


FORMAT = Format(
    "Kalibr camchain",
    "application/yaml",
    ".camchain.yaml",
    "Brown–Conrady with k1, k2, p1, p2 (radtan) and fisheye (equidistant); no pose.",
    write,
    camera_file.read,
    lenses={"brown-conrady": ("k1", "k2", "p1", "p2"), "fisheye": FISHEYE_TERMS},
)
