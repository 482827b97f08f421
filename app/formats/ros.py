"""ROS: the camera_info YAML of camera_calibration and camera_info_manager.

plumb_bob has k1 k2 p1 p2 k3, rational_polynomial k4 k5 k6 as well, equidistant the four of a fisheye. The format has no
pose: ours stands in a comment, in the field's mm.
"""

import re
from typing import ClassVar

from app.core.records import Calibration
from app.core.strict_yaml import plain_from_yaml
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile, size_of
from app.formats.metadata import about_in, header
from app.formats.numbers import entry, intrinsics, listed, matrix, numbers, refuse, whole
from app.formats.opencv_terms import WITH_FISHEYE, lengthened, shortened

BY_COUNT = {5: "plumb_bob", 8: "rational_polynomial"}
KEY = re.compile(rb"^(?:distortion_model|projection_matrix|camera_name) {0,9}:", re.MULTILINE)
COUNTS = {"plumb_bob": (4, 5), "rational_polynomial": (8,), "equidistant": (4,), "fisheye": (4,)}


class Ros:
    NAME: ClassVar[str] = "ros"
    TITLE: ClassVar[str] = "ROS camera_info"
    MEDIA_TYPE: ClassVar[str] = "application/yaml"
    SUFFIX: ClassVar[str] = ".yaml"
    HOLDS: ClassVar[str] = "Brown–Conrady (plumb_bob, rational_polynomial) and fisheye (equidistant); no pose."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = WITH_FISHEYE
    SQUARE_PIXELS: ClassVar[bool] = False

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        camera = held.camera
        fisheye = camera.NAME == "fisheye"
        terms = camera.lens_terms if fisheye else shortened(camera.lens_terms)
        fx, fy = camera.focal_px, camera.focal_px * camera.aspect
        cx, cy = camera.centre_px
        name = re.sub(r"[^A-Za-z0-9_]", "_", calibration.camera or "camera")
        lines = [f"image_width: {camera.image_size.width}", f"image_height: {camera.image_size.height}",
                 f"camera_name: cam_{name}" if name[0].isdigit() else f"camera_name: {name}",
                 _matrix("camera_matrix", 3, (fx, 0, cx, 0, fy, cy, 0, 0, 1)),
                 f"distortion_model: {'equidistant' if fisheye else BY_COUNT[len(terms)]}",
                 _matrix("distortion_coefficients", 1, terms),
                 _matrix("rectification_matrix", 3, (1, 0, 0, 0, 1, 0, 0, 0, 1)),
                 _matrix("projection_matrix", 3, (fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0))]
        return (header(calibration, held, pose=True) + "\n".join(lines) + "\n").encode()

    @staticmethod
    def recognises(data: bytes) -> bool:
        return KEY.search(data[:65536]) is not None

    @staticmethod
    def read(data: bytes) -> CameraFile:
        value = plain_from_yaml(data, "The file", as_text=True)
        k = matrix(entry(value, "camera_matrix", "The file"), "camera_matrix", 3, 3)
        focal, centre = intrinsics(k, "camera_matrix")
        model = value.get("distortion_model", "plumb_bob")
        if not isinstance(model, str) or model not in COUNTS:
            raise refuse(f"distortion_model is {str(model)[:40]!r}.", f"Use one of: {', '.join(COUNTS)}.")
        at = "distortion_coefficients"
        given = entry(value, at, "The file")
        terms = numbers(entry(given, "data", at), f"{at}.data", COUNTS[model])
        rows, columns = (whole(entry(given, key, at), f"{at}.{key}", 1, 100) for key in ("rows", "cols"))
        if rows * columns != len(terms):
            raise refuse(f"{at} has {len(terms)} numbers for {rows} × {columns}.", "Correct the file.")
        size = size_of(entry(value, "image_width", "The file"), entry(value, "image_height", "The file"))
        fisheye = COUNTS[model] == (4,)
        about = about_in(data)
        return CameraFile("ros", "fisheye" if fisheye else "brown-conrady",
                          terms if fisheye else lengthened(terms, at), focal, centre, size, about,
                          about.pose if about.field is not None else None)


def _matrix(name: str, rows: int, data: tuple[float, ...]) -> str:
    return f"{name}:\n  rows: {rows}\n  cols: {len(data) // rows}\n  data: {listed(data)}"
