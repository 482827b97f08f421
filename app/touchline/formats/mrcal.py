"""mrcal: a .cameramodel with LENSMODEL_PINHOLE, OPENCV4, OPENCV5 or OPENCV8, and the pose.

extrinsics are rt_fromref: a rotation vector and a translation that take field coordinates to the camera, here in
metres, as mrcal's tools expect lengths; 'intrinsics' are fx, fy, cx, cy and OpenCV's terms.
"""

from touchline.core.records import Calibration
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header
from touchline.formats.numbers import format_list

MODELS = {
    "LENSMODEL_PINHOLE": 0,
    "LENSMODEL_OPENCV4": 4,
    "LENSMODEL_OPENCV5": 5,
    "LENSMODEL_OPENCV8": 8,
    "LENSMODEL_OPENCV12": 12,
}


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    terms = camera_file.trim_terms(camera.lens_terms, (0, 4, 5, 8))
    name = next(n for n, count in MODELS.items() if count == len(terms))
    translation = camera_file.translation_of(camera) / camera_file.MM_PER_M
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


FORMAT = Format(
    "mrcal camera model",
    "text/plain",
    ".cameramodel",
    "Brown–Conrady lenses (OPENCV4, 5 and 8), with the pose.",
    write,
    camera_file.read,
    lenses=camera_file.LENSES,
)
