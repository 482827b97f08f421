"""Kalibr: a camchain with one camera, pinhole with radtan (k1 k2 p1 p2) or equidistant (the four of a fisheye).

The chain's transformations are between cameras and to an IMU, none to a field: our pose stands in a comment.
"""

import re

from touchline.core.records import Calibration
from touchline.core.strict_yaml import plain_from_yaml
from touchline.formats import Format
from touchline.formats.approximation import ExportCamera, header, metadata_from_comment
from touchline.formats.camera_file import CameraFile, checked_size, intrinsics_of, lens_from_terms
from touchline.formats.numbers import format_error, format_list, numbers, require
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS

COUNTS = {"radtan": (4,), "equidistant": (4,), "none": (0,)}


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    fisheye = camera.NAME == "fisheye"
    topic = re.sub(r"[^A-Za-z0-9_]", "_", calibration.camera or "camera")
    lines = [
        "cam0:",
        "  camera_model: pinhole",
        f"  intrinsics: {format_list(intrinsics_of(camera))}",
        f"  distortion_model: {'equidistant' if fisheye else 'radtan'}",
        f"  distortion_coeffs: {format_list(camera.lens_terms[:4])}",
        f"  resolution: [{camera.image_size.width}, {camera.image_size.height}]",
        f"  rostopic: /{topic}/image_raw",
    ]
    return (header(calibration, export, pose=True) + "\n".join(lines) + "\n").encode()


def read(data: bytes) -> CameraFile:
    """The only camera of the chain."""
    value = plain_from_yaml(data, "The file", as_text=True)
    cameras = (
        [key for key in value if re.fullmatch(r"cam[0-9]+", key)] if isinstance(value, dict) else []
    )
    if len(cameras) != 1:
        raise format_error(
            f"The file contains {len(cameras)} cameras."
            if cameras
            else "The file contains no camera.",
            "Use a chain with one camera, cam0.",
        )
    at = cameras[0]
    camera = value[at]
    if require(camera, "camera_model", at) != "pinhole":
        raise format_error(
            f"{at}.camera_model is {str(camera['camera_model'])[:40]!r}.", "Calibrate with pinhole."
        )
    model = require(camera, "distortion_model", at)
    if not isinstance(model, str) or model not in COUNTS:
        raise format_error(
            f"{at}.distortion_model is {str(model)[:40]!r}.", f"Use one of: {', '.join(COUNTS)}."
        )
    fx, fy, cx, cy = numbers(require(camera, "intrinsics", at), f"{at}.intrinsics", (4,))
    terms = numbers(
        require(camera, "distortion_coeffs", at), f"{at}.distortion_coeffs", COUNTS[model]
    )
    size = checked_size(*numbers(require(camera, "resolution", at), f"{at}.resolution", (2,)))
    metadata = metadata_from_comment(data)
    return CameraFile(
        "kalibr",
        *lens_from_terms(terms, at, model == "equidistant"),
        (fx, fy),
        (cx, cy),
        size,
        metadata,
        metadata.field_pose,
    )


FORMAT = Format(
    "Kalibr camchain",
    "application/yaml",
    ".camchain.yaml",
    "Brown–Conrady with k1, k2, p1, p2 (radtan) and fisheye (equidistant); no pose.",
    write,
    read,
    recognises=lambda data: (
        re.search(rb"^cam[0-9]{1,3} {0,9}:", data[:65536], re.MULTILINE) is not None
    ),
    lenses={"brown-conrady": ("k1", "k2", "p1", "p2"), "fisheye": FISHEYE_TERMS},
)
