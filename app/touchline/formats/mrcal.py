"""mrcal: a .cameramodel with LENSMODEL_PINHOLE, OPENCV4, OPENCV5 or OPENCV8, and the pose.

extrinsics are rt_fromref: a rotation vector and a translation that take field coordinates to the camera, here in
metres, as mrcal's tools expect lengths; 'intrinsics' are fx, fy, cx, cy and OpenCV's terms.
"""

import re

import numpy as np

from touchline.core.records import Calibration
from touchline.core.strict_yaml import plain_from_yaml
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header, metadata_from_comment
from touchline.formats.camera_file import CameraFile, checked_size
from touchline.formats.numbers import format_error, format_list, numbers, require

MODELS = {
    "LENSMODEL_PINHOLE": 0,
    "LENSMODEL_OPENCV4": 4,
    "LENSMODEL_OPENCV5": 5,
    "LENSMODEL_OPENCV8": 8,
    "LENSMODEL_OPENCV12": 12,
}
MM_PER_M = 1000.0
KEY = re.compile(rb"""['"]lensmodel['"]\s{0,9}:\s{0,9}['"]LENSMODEL_""")
MAX_BYTES = 4 << 20  # mrcal keeps what it solved inside its files
SOLVED = re.compile(rb""":\s{0,9}b(?:'[^'\n]*'|"[^"\n]*")""")


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    terms = camera_file.trim_terms(camera.lens_terms, (0, 4, 5, 8))
    name = next(n for n, count in MODELS.items() if count == len(terms))
    translation = camera_file.translation_of(camera) / MM_PER_M
    width, height = camera.image_size
    text = header(
        calibration,
        export,
        "extrinsics take field coordinates in metres to the camera (rt_fromref).",
        pose=False,
    )
    intrinsics = (*camera_file.intrinsics_of(camera), *terms)
    text += (
        f"{{\n    'lensmodel': '{name}',\n\n    'intrinsics': {format_list(intrinsics)},\n\n"
        f"    'extrinsics': {format_list((*camera.rotation, *translation))},\n\n"
        f"    'imagersize': [{width}, {height}],\n}}\n"
    )
    return text.encode()


def read(data: bytes) -> CameraFile:
    if len(data) > MAX_BYTES:
        raise format_error(
            f"The file has {len(data)} bytes. The limit is {MAX_BYTES}.", "Use a shorter file."
        )
    # the rest of the Python dictionary is YAML as well
    value = plain_from_yaml(SOLVED.sub(b": ''", data), "The file", as_text=True)
    name = require(value, "lensmodel", "The file")
    if not isinstance(name, str) or name not in MODELS:
        raise format_error(f"lensmodel is {str(name)[:60]!r}.", f"Use one of: {', '.join(MODELS)}.")
    fx, fy, cx, cy, *terms = numbers(
        require(value, "intrinsics", "The file"), "intrinsics", (4 + MODELS[name],)
    )
    size = checked_size(*numbers(require(value, "imagersize", "The file"), "imagersize", (2,)))
    metadata = metadata_from_comment(data)
    rt = numbers(require(value, "extrinsics", "The file"), "extrinsics", (6,))
    placed = metadata.field is not None
    pose = camera_file.pose_from_field(rt[:3], np.array(rt[3:]) * MM_PER_M) if placed else None
    notes = (
        ()
        if placed or not any(rt)
        else ("The extrinsics do not refer to a field and were ignored.",)
    )
    lens = camera_file.lens_from_terms(tuple(terms), "intrinsics")
    return CameraFile("mrcal", *lens, (fx, fy), (cx, cy), size, metadata, pose, notes=notes)


FORMAT = Format(
    "mrcal camera model",
    "text/plain",
    ".cameramodel",
    "Brown–Conrady lenses (OPENCV4, 5 and 8), with the pose.",
    write,
    read,
    # PhotonVision names its lenses so, too
    recognises=lambda data: KEY.search(data) is not None and b'"cameraIntrinsics"' not in data,
    lenses=camera_file.LENSES,
)
