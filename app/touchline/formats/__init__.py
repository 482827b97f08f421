"""File formats that a calibration is written to and read from: a contract, a table, one file a format.

A format is a value, FORMAT, with words about it and these functions:

    write(calibration, progress) -> bytes  of a format that holds every model
    write(calibration, export) -> bytes    of a camera format: one with lenses, the terms it knows by model name. It is
                                           given the calibration's own camera, or the nearest that the format can hold
                                           (approximation.py), as an ExportCamera
    recognises(data) -> bool               a quick look at the bytes; only of a format that is read by a reader of its
                                           own: camera_file.read tells the other programs' files apart itself
    read(data)                             the same: check everything, return a Calibration (ours), a CameraFile (a
                                           lens, with a pose where the file names a field) or Observations (points),
                                           and raise nothing but a TouchlineError for other bytes

To add one: write formats/NAME.py, add its line to FORMATS, and make its golden files (tests/golden/make.py). The
tests walk the table. Camera formats are only written here: camera_file.py reads them and those of many other programs,
by document.py (the syntax), program_forms.py (forms of their own), camera_names.py and stated_camera.py (the names and
numbers) and other_lenses.py (lenses that Touchline has not); ssl_settings.py reads ssl-vision's settings as
league_file.py has them. approximation.py holds the metadata that a format has no place for, numbers.py strict numbers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as member
from typing import Any

from touchline.core.registry import Registry


@dataclass(frozen=True)
class Format:
    """The contract. holds: what the format can represent, in one sentence."""

    title: str
    media_type: str
    suffix: str
    holds: str
    write: Callable[..., bytes]
    read: Callable[..., Any] | None = None  # None where it cannot be read back
    recognises: Callable[[bytes], bool] | None = None
    # of a camera format: terms by model name
    lenses: Mapping[str, tuple[str, ...]] = member(default_factory=dict)
    square_pixels: bool = False  # whether a camera must have them


FORMATS: Registry[Format] = Registry(
    "export format",
    {
        "json": "touchline.formats.json_file:FORMAT",  # ours, complete, read back exactly
        "opencv": "touchline.formats.opencv:FORMAT",  # cv2.FileStorage, lens and pose
        "ros": "touchline.formats.ros:FORMAT",  # camera_info
        "kalibr": "touchline.formats.kalibr:FORMAT",  # a camchain of one camera
        "mrcal": "touchline.formats.mrcal:FORMAT",  # .cameramodel, lens and pose
        "photonvision": "touchline.formats.photonvision:FORMAT",  # one resolution's calibration
        # the league's geometry packet: lens, pose and field
        "ssl-vision": "touchline.formats.ssl_vision:FORMAT",
        # geometry.yml of vision-processor: the same, for its publisher
        "vision-processor": "touchline.formats.vision_processor:FORMAT",
        # its config.yml: four corners and a height, for its own calibration
        "vision-processor-start": "touchline.formats.vision_processor_start:FORMAT",
        # a remap table: correct pictures with numpy and OpenCV alone
        "npz": "touchline.formats.npz_file:FORMAT",
        # clicks and a grid of positions, for spreadsheets
        "csv": "touchline.formats.csv_points:FORMAT",
    },
)
