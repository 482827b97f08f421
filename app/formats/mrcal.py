"""mrcal: a .cameramodel with LENSMODEL_PINHOLE, OPENCV4, OPENCV5 or OPENCV8, and the pose.

extrinsics are rt_fromref: a rotation vector and a translation that take field coordinates to the camera, here in
metres, as mrcal's tools expect lengths; 'intrinsics' are fx, fy, cx, cy and OpenCV's terms.
"""

import re
from typing import ClassVar

import numpy as np

from app.core.records import Calibration
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile, size_of
from app.formats.metadata import about_in, header, pose_of
from app.formats.numbers import entry, listed, number, numbers, refuse
from app.formats.opencv_terms import LENSES, lengthened, shortened
from app.formats.python_literal import literal
from app.models.rotation import matrix_from_vector

MODELS = {"LENSMODEL_PINHOLE": 0, "LENSMODEL_OPENCV4": 4, "LENSMODEL_OPENCV5": 5, "LENSMODEL_OPENCV8": 8,
          "LENSMODEL_OPENCV12": 12}
MM_PER_M = 1000.0
KEY = re.compile(rb"""['"]lensmodel['"]\s{0,9}:\s{0,9}['"]LENSMODEL_""")


class Mrcal:
    NAME: ClassVar[str] = "mrcal"
    TITLE: ClassVar[str] = "mrcal camera model"
    MEDIA_TYPE: ClassVar[str] = "text/plain"
    SUFFIX: ClassVar[str] = ".cameramodel"
    HOLDS: ClassVar[str] = "Brown–Conrady lenses (OPENCV4, 5 and 8), with the pose."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = LENSES
    SQUARE_PIXELS: ClassVar[bool] = False

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        camera = held.camera
        terms = shortened(camera.lens_terms, (0, 4, 5, 8))
        name = next(n for n, count in MODELS.items() if count == len(terms))
        core = (camera.focal_px, camera.focal_px * camera.aspect, *camera.centre_px)
        translation = -matrix_from_vector(np.array(camera.rotation)) @ np.array(camera.position_mm) / MM_PER_M
        width, height = camera.image_size
        text = header(calibration, held, "extrinsics take field coordinates in metres to the camera (rt_fromref).",
                      pose=False)
        text += (f"{{\n    'lensmodel': '{name}',\n\n    'intrinsics': {listed((*core, *terms))},\n\n"
                 f"    'extrinsics': {listed((*camera.rotation, *translation))},\n\n"
                 f"    'imagersize': [{width}, {height}],\n}}\n")
        return text.encode()

    @staticmethod
    def recognises(data: bytes) -> bool:
        return KEY.search(data) is not None and b'"cameraIntrinsics"' not in data  # PhotonVision names its lenses so

    @staticmethod
    def read(data: bytes) -> CameraFile:
        value = literal(data, "The file")
        name = entry(value, "lensmodel", "The file")
        if not isinstance(name, str) or name not in MODELS:
            raise refuse(f"lensmodel is {str(name)[:60]!r}.", f"Use one of: {', '.join(MODELS)}.")
        fx, fy, cx, cy, *terms = numbers(entry(value, "intrinsics", "The file"), "intrinsics", (4 + MODELS[name],))
        size = size_of(*numbers(entry(value, "imagersize", "The file"), "imagersize", (2,)))
        about = about_in(data)
        rt = numbers(entry(value, "extrinsics", "The file"), "extrinsics", (6,))
        pose, notes = None, ()
        if about.field is not None:
            number(float(np.linalg.norm(rt[:3])), "The camera's rotation", 0, 10)
            pose = pose_of(rt[:3], -matrix_from_vector(np.array(rt[:3])).T @ np.array(rt[3:]) * MM_PER_M)
        elif any(rt):
            notes = ("Its extrinsics belong to another frame than a field's, and were left aside.",)
        return CameraFile("mrcal", "brown-conrady", lengthened(tuple(terms), "intrinsics"), (fx, fy), (cx, cy), size,
                          about, pose, notes=notes)
