"""ROS: the camera_info YAML of camera_calibration and camera_info_manager.

plumb_bob has k1 k2 p1 p2 k3, rational_polynomial k4 k5 k6 as well, equidistant the four of a fisheye. The format has no
pose: ours stands in a comment, in the field's mm.
"""

import re

from touchline.core.records import Calibration
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header
from touchline.formats.numbers import format_list

BY_COUNT = {5: "plumb_bob", 8: "rational_polynomial"}


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    fisheye = camera.NAME == "fisheye"
    terms, (fx, fy, cx, cy) = camera_file.lens_terms(camera), camera_file.intrinsics_of(camera)
    name = re.sub(r"[^A-Za-z0-9_]", "_", calibration.camera or "camera")
    lines = [
        f"image_width: {camera.image_size.width}",
        f"image_height: {camera.image_size.height}",
        f"camera_name: cam_{name}" if name[0].isdigit() else f"camera_name: {name}",
        _matrix("camera_matrix", 3, camera_file.matrix_of(camera)),
        f"distortion_model: {'equidistant' if fisheye else BY_COUNT[len(terms)]}",
        _matrix("distortion_coefficients", 1, terms),
        _matrix("rectification_matrix", 3, (1, 0, 0, 0, 1, 0, 0, 0, 1)),
        _matrix("projection_matrix", 3, (fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0)),
    ]
    return (header(calibration, export, pose=True) + "\n".join(lines) + "\n").encode()


def _matrix(name: str, rows: int, data: tuple[float, ...]) -> str:
    return f"{name}:\n  rows: {rows}\n  cols: {len(data) // rows}\n  data: {format_list(data)}"


FORMAT = Format(
    "ROS camera_info",
    "application/yaml",
    ".yaml",
    "Brown–Conrady (plumb_bob, rational_polynomial) and fisheye (equidistant); no pose.",
    write,
    camera_file.read,
    lenses=camera_file.LENSES_WITH_FISHEYE,
)
