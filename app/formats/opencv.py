"""OpenCV: the YAML that cv2.FileStorage reads, written so that plain YAML readers read it as well.

Matrices stand as mappings {rows, cols, dt, data} without OpenCV's tag, which it does not need and others choke on; and
the first line is "%YAML 1.0", since "%YAML:1.0" is no YAML. camera_matrix and distortion_coefficients as in OpenCV's
own calibration sample (there fisheye_model: 1 means cv2.fisheye); rotation_vector and translation_vector as
cv2.projectPoints takes them, field mm to camera.
"""

import re
from typing import Any, ClassVar

import numpy as np

from app.core.records import Calibration
from app.core.strict_yaml import plain_from_yaml
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile, size_of
from app.formats.metadata import about_in, header, pose_of
from app.formats.numbers import entry, intrinsics, listed, matrix, number, numbers, refuse, whole
from app.formats.opencv_terms import WITH_FISHEYE, lengthened, shortened
from app.models.rotation import matrix_from_vector

TAG = "tag:yaml.org,2002:opencv-matrix"
DIRECTIVE = re.compile(rb"\A(?:\xef\xbb\xbf)?%YAML[: ][^\n]*\n")
MATRIX_NAMES = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "mtx")
TERMS_NAMES = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "D", "dist")


class OpenCv:
    NAME: ClassVar[str] = "opencv"
    TITLE: ClassVar[str] = "OpenCV YAML"
    MEDIA_TYPE: ClassVar[str] = "application/yaml"
    SUFFIX: ClassVar[str] = ".yml"
    HOLDS: ClassVar[str] = "Brown–Conrady and fisheye lenses, with the pose; for cv2.FileStorage."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = WITH_FISHEYE
    SQUARE_PIXELS: ClassVar[bool] = False

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        camera = held.camera
        fisheye = camera.NAME == "fisheye"
        terms = camera.lens_terms if fisheye else shortened(camera.lens_terms)
        k = (camera.focal_px, 0.0, camera.centre_px[0], 0.0, camera.focal_px * camera.aspect, camera.centre_px[1],
             0.0, 0.0, 1.0)
        translation = -matrix_from_vector(np.array(camera.rotation)) @ np.array(camera.position_mm)
        text = "%YAML 1.0\n---\n" + header(
            calibration, held, "rotation_vector and translation_vector take field mm to the camera: "
            f"{'cv2.fisheye' if fisheye else 'cv2'}.projectPoints gives raw pixels.", pose=False)
        text += f"image_width: {camera.image_size.width}\nimage_height: {camera.image_size.height}\n"
        text += f"fisheye_model: {int(fisheye)}\n"
        for name, rows, data in (("camera_matrix", 3, k), ("distortion_coefficients", len(terms), terms),
                                 ("rotation_vector", 3, camera.rotation), ("translation_vector", 3, translation)):
            text += (f"{name}:\n   rows: {rows}\n   cols: {len(data) // rows}\n   dt: d\n"
                     f"   data: {listed(data)}\n")
        return text.encode()

    @staticmethod
    def recognises(data: bytes) -> bool:
        return bool(DIRECTIVE.match(data)) or b"!!opencv-matrix" in data[:4096]

    @staticmethod
    def read(data: bytes) -> CameraFile:
        """One camera; BadInput for anything else. Of values that we do not know only the form is looked at."""
        value = plain_from_yaml(DIRECTIVE.sub(b"", data), "The file", as_text=True, tags=(TAG,))
        if not isinstance(value, dict):
            raise refuse("The file holds no camera matrix.", "Give one with camera_matrix.")
        k = matrix(_one_of(value, MATRIX_NAMES), "camera_matrix", 3, 3)
        focal, centre = intrinsics(k, "camera_matrix")
        fisheye = whole(value.get("fisheye_model", 0), "fisheye_model", 0, 1) == 1
        terms = _vector(_one_of(value, TERMS_NAMES), "distortion_coefficients", (4,) if fisheye else (4, 5, 8, 12, 14))
        sized = "image_width" in value
        size = size_of(value["image_width"], entry(value, "image_height", "The file")) if sized else None
        about = about_in(data)
        pose = None
        if about.field is not None and "rotation_vector" in value:
            rotation = _vector(value["rotation_vector"], "rotation_vector", (3,))
            translation = _vector(entry(value, "translation_vector", "The file"), "translation_vector", (3,))
            number(float(np.linalg.norm(rotation)), "The camera's rotation", 0, 10)
            pose = pose_of(rotation, -matrix_from_vector(np.array(rotation)).T @ np.array(translation))
        return CameraFile("opencv", "fisheye" if fisheye else "brown-conrady",
                          terms if fisheye else lengthened(terms, "distortion_coefficients"), focal, centre, size,
                          about, pose)


def _one_of(value: dict[str, Any], names: tuple[str, ...]) -> Any:
    for name in names:
        if name in value:
            return value[name]
    raise refuse(f"The file has no {names[0]}.", f"Give one camera, with {MATRIX_NAMES[0]} and {TERMS_NAMES[0]}.")


def _vector(value: Any, at: str, counts: tuple[int, ...]) -> tuple[float, ...]:
    """A row or a column of numbers."""
    rows = whole(entry(value, "rows", at), f"{at}.rows", 1, 100)
    columns = whole(entry(value, "cols", at), f"{at}.cols", 1, 100)
    if min(rows, columns) != 1:
        raise refuse(f"{at} is {rows} × {columns}.", "Give one row or one column.")
    found = numbers(entry(value, "data", at), f"{at}.data", counts)
    if len(found) != rows * columns:
        raise refuse(f"{at} has {len(found)} numbers for {rows} × {columns}.", "Correct the file.")
    return found
