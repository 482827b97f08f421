"""Kalibr: a camchain with one camera, pinhole with radtan (k1 k2 p1 p2) or equidistant (the four of a fisheye).

The chain's transformations are between cameras and to an IMU, none to a field: our pose stands in a comment.
"""

import re
from typing import ClassVar

from app.core.records import Calibration
from app.core.strict_yaml import plain_from_yaml
from app.formats.approximation import Held
from app.formats.camera_file import CameraFile, size_of
from app.formats.metadata import about_in, header
from app.formats.numbers import entry, listed, numbers, refuse
from app.formats.opencv_terms import lengthened
from app.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS

COUNTS = {"radtan": (4,), "equidistant": (4,), "none": (0,)}
RADTAN = ("k1", "k2", "p1", "p2")


class Kalibr:
    NAME: ClassVar[str] = "kalibr"
    TITLE: ClassVar[str] = "Kalibr camchain"
    MEDIA_TYPE: ClassVar[str] = "application/yaml"
    SUFFIX: ClassVar[str] = ".camchain.yaml"
    HOLDS: ClassVar[str] = "Brown–Conrady with k1, k2, p1, p2 (radtan) and fisheye (equidistant); no pose."
    LENSES: ClassVar[dict[str, tuple[str, ...]]] = {"brown-conrady": RADTAN, "fisheye": FISHEYE_TERMS}
    SQUARE_PIXELS: ClassVar[bool] = False

    @staticmethod
    def write(calibration: Calibration, held: Held) -> bytes:
        camera = held.camera
        fisheye = camera.NAME == "fisheye"
        core = (camera.focal_px, camera.focal_px * camera.aspect, *camera.centre_px)
        topic = re.sub(r"[^A-Za-z0-9_]", "_", calibration.camera or "camera")
        lines = ["cam0:", "  camera_model: pinhole", f"  intrinsics: {listed(core)}",
                 f"  distortion_model: {'equidistant' if fisheye else 'radtan'}",
                 f"  distortion_coeffs: {listed(camera.lens_terms[:4])}",
                 f"  resolution: [{camera.image_size.width}, {camera.image_size.height}]",
                 f"  rostopic: /{topic}/image_raw"]
        return (header(calibration, held, pose=True) + "\n".join(lines) + "\n").encode()

    @staticmethod
    def recognises(data: bytes) -> bool:
        return re.search(rb"^cam[0-9]{1,3} {0,9}:", data[:65536], re.MULTILINE) is not None

    @staticmethod
    def read(data: bytes) -> CameraFile:
        """The only camera of the chain."""
        value = plain_from_yaml(data, "The file", as_text=True)
        cameras = [key for key in value if re.fullmatch(r"cam[0-9]+", key)] if isinstance(value, dict) else []
        if len(cameras) != 1:
            raise refuse(f"The file holds {len(cameras)} cameras." if cameras else "The file holds no camera.",
                         "Give a chain with one camera, cam0.")
        at = cameras[0]
        camera = value[at]
        if entry(camera, "camera_model", at) != "pinhole":
            raise refuse(f"{at}.camera_model is {str(camera['camera_model'])[:40]!r}.", "Calibrate with pinhole.")
        model = entry(camera, "distortion_model", at)
        if not isinstance(model, str) or model not in COUNTS:
            raise refuse(f"{at}.distortion_model is {str(model)[:40]!r}.", f"Use one of: {', '.join(COUNTS)}.")
        fx, fy, cx, cy = numbers(entry(camera, "intrinsics", at), f"{at}.intrinsics", (4,))
        terms = numbers(entry(camera, "distortion_coeffs", at), f"{at}.distortion_coeffs", COUNTS[model])
        size = size_of(*numbers(entry(camera, "resolution", at), f"{at}.resolution", (2,)))
        about = about_in(data)
        fisheye = model == "equidistant"
        return CameraFile("kalibr", "fisheye" if fisheye else "brown-conrady",
                          terms if fisheye else lengthened(terms, at), (fx, fy), (cx, cy), size, about,
                          about.pose if about.field is not None else None)
