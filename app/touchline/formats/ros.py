"""ROS: the camera_info YAML of camera_calibration and camera_info_manager.

plumb_bob has k1 k2 p1 p2 k3, rational_polynomial k4 k5 k6 as well, equidistant the four of a fisheye. The format has no
pose: ours stands in a comment, in the field's mm.
"""

import re

from touchline.core.records import Calibration
from touchline.core.strict_yaml import plain_from_yaml
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header, metadata_from_comment
from touchline.formats.camera_file import CameraFile, checked_size
from touchline.formats.numbers import format_error, format_list, integer, numbers, require

BY_COUNT = {5: "plumb_bob", 8: "rational_polynomial"}
KEY = re.compile(rb"^(?:distortion_model|projection_matrix|camera_name) {0,9}:", re.MULTILINE)
COUNTS = {"plumb_bob": (4, 5), "rational_polynomial": (8,), "equidistant": (4,), "fisheye": (4,)}


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


def read(data: bytes) -> CameraFile:
    value = plain_from_yaml(data, "The file", as_text=True)
    focal, centre = camera_file.read_intrinsics(
        require(value, "camera_matrix", "The file"), "camera_matrix"
    )
    model = value.get("distortion_model", "plumb_bob")
    if not isinstance(model, str) or model not in COUNTS:
        raise format_error(
            f"distortion_model is {str(model)[:40]!r}.", f"Use one of: {', '.join(COUNTS)}."
        )
    at = "distortion_coefficients"
    given = require(value, at, "The file")
    terms = numbers(require(given, "data", at), f"{at}.data", COUNTS[model])
    rows, columns = (
        integer(require(given, key, at), f"{at}.{key}", 1, 100) for key in ("rows", "cols")
    )
    if rows * columns != len(terms):
        raise format_error(
            f"{at} has {len(terms)} numbers for {rows} × {columns}.", "Correct the file."
        )
    size = checked_size(
        require(value, "image_width", "The file"), require(value, "image_height", "The file")
    )
    metadata = metadata_from_comment(data)
    lens = camera_file.lens_from_terms(terms, at, COUNTS[model] == (4,))
    return CameraFile("ros", *lens, focal, centre, size, metadata, metadata.field_pose)


def _matrix(name: str, rows: int, data: tuple[float, ...]) -> str:
    return f"{name}:\n  rows: {rows}\n  cols: {len(data) // rows}\n  data: {format_list(data)}"


FORMAT = Format(
    "ROS camera_info",
    "application/yaml",
    ".yaml",
    "Brown–Conrady (plumb_bob, rational_polynomial) and fisheye (equidistant); no pose.",
    write,
    read,
    recognises=lambda data: KEY.search(data[:65536]) is not None,
    lenses=camera_file.LENSES_WITH_FISHEYE,
)
