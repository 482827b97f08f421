"""OpenCV: the YAML that cv2.FileStorage reads, written so that plain YAML readers read it as well.

Matrices stand as mappings {rows, cols, dt, data} without OpenCV's tag, which it does not need and others choke on; and
the first line is "%YAML 1.0", since "%YAML:1.0" is no YAML. camera_matrix and distortion_coefficients as in OpenCV's
own calibration sample (there fisheye_model: 1 means cv2.fisheye); rotation_vector and translation_vector as
cv2.projectPoints takes them, field mm to camera.
"""

import re
from typing import Any

import numpy as np

from touchline.core.records import Calibration
from touchline.core.strict_yaml import plain_from_yaml
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header, metadata_from_comment
from touchline.formats.camera_file import CameraFile, checked_size
from touchline.formats.numbers import format_error, format_list, integer, require, vector

TAG = "tag:yaml.org,2002:opencv-matrix"
DIRECTIVE = re.compile(rb"\A(?:\xef\xbb\xbf)?%YAML[: ][^\n]*\n")
MATRIX_NAMES = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "mtx")
TERMS_NAMES = (
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "D",
    "dist",
)


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    fisheye, terms = camera.NAME == "fisheye", camera_file.lens_terms(camera)
    text = "%YAML 1.0\n---\n" + header(
        calibration,
        export,
        "rotation_vector and translation_vector take field mm to the camera: "
        f"{'cv2.fisheye' if fisheye else 'cv2'}.projectPoints gives raw pixels.",
        pose=False,
    )
    text += f"image_width: {camera.image_size.width}\nimage_height: {camera.image_size.height}\n"
    text += f"fisheye_model: {int(fisheye)}\n"
    for name, rows, data in (
        ("camera_matrix", 3, camera_file.matrix_of(camera)),
        ("distortion_coefficients", len(terms), terms),
        ("rotation_vector", 3, camera.rotation),
        ("translation_vector", 3, camera_file.translation_of(camera)),
    ):
        text += f"{name}:\n   rows: {rows}\n   cols: {len(data) // rows}\n   dt: d\n   data: {format_list(data)}\n"
    return text.encode()


def read(data: bytes) -> CameraFile:
    """One camera; BadInput for anything else. Of values that we do not know only the form is looked at."""
    value = plain_from_yaml(DIRECTIVE.sub(b"", data), "The file", as_text=True, tags=(TAG,))
    if not isinstance(value, dict):
        raise format_error("The file contains no camera matrix.", "Use a file with camera_file.")
    focal, centre = camera_file.read_intrinsics(_one_of(value, MATRIX_NAMES), "camera_matrix")
    fisheye = integer(value.get("fisheye_model", 0), "fisheye_model", 0, 1) == 1
    terms = vector(
        _one_of(value, TERMS_NAMES),
        "distortion_coefficients",
        (4,) if fisheye else (4, 5, 8, 12, 14),
    )
    sized = "image_width" in value
    size = (
        checked_size(value["image_width"], require(value, "image_height", "The file"))
        if sized
        else None
    )
    metadata = metadata_from_comment(data)
    pose = None
    if metadata.field is not None and "rotation_vector" in value:
        rotation = vector(value["rotation_vector"], "rotation_vector", (3,))
        translation = vector(
            require(value, "translation_vector", "The file"), "translation_vector", (3,)
        )
        pose = camera_file.pose_from_field(rotation, np.array(translation))
    lens = camera_file.lens_from_terms(terms, "distortion_coefficients", fisheye)
    return CameraFile("opencv", *lens, focal, centre, size, metadata, pose)


def _one_of(value: dict[str, Any], names: tuple[str, ...]) -> Any:
    for name in names:
        if name in value:
            return value[name]
    raise format_error(
        f"The file has no {names[0]}.",
        f"Use a file with one camera, with {MATRIX_NAMES[0]} and {TERMS_NAMES[0]}.",
    )


FORMAT = Format(
    "OpenCV YAML",
    "application/yaml",
    ".yml",
    "Brown–Conrady and fisheye lenses, with the pose; for cv2.FileStorage.",
    write,
    read,
    recognises=lambda data: bool(DIRECTIVE.match(data)) or b"!!opencv-matrix" in data[:4096],
    lenses=camera_file.LENSES_WITH_FISHEYE,
)
