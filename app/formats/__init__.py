"""File formats that a calibration is written to and read from: a contract, a table, one file a format.

A format is a subclass of Format that fills in its class variables and these static methods:

    write(calibration) -> bytes            of a format that holds every model
    write(calibration, export) -> bytes    of a camera format: one with LENSES, the terms it knows by model name. It is
                                           given the calibration's own camera, or the nearest that the format can hold
                                           (approximation.py), as an ExportCamera
    recognises(data) -> bool               a quick look at the bytes; only of a format with READS = True
    read(data)                             the same: check everything, return a Calibration (ours), a CameraFile (a
                                           lens, with a pose where the file names a field) or Observations (points),
                                           and raise nothing but a TouchlineError for other bytes

To add one: write app/formats/NAME.py, add its line to FORMATS, and make its golden files (tests/golden/make.py). The
tests walk the table. For camera formats camera_file.py holds what their readers share, camera_matrix.py what their
writers share, metadata.py the field and pose that a format has no place for, numbers.py strict numbers in text.
"""

from collections.abc import Mapping
from typing import ClassVar

from app.core.registry import Registry


class Format:
    """The contract. HOLDS: what the format can represent, in one sentence."""

    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    MEDIA_TYPE: ClassVar[str]
    SUFFIX: ClassVar[str]
    HOLDS: ClassVar[str]
    READS: ClassVar[bool] = True
    LENSES: ClassVar[Mapping[str, tuple[str, ...]]] = {}  # of a camera format: terms by model name
    SQUARE_PIXELS: ClassVar[bool] = False  # whether a camera must have them


FORMATS = Registry("export format", {
    "json": "app.formats.json_file:JsonFile",  # ours, complete, read back exactly
    "opencv": "app.formats.opencv:OpenCv",  # cv2.FileStorage, lens and pose
    "ros": "app.formats.ros:Ros",  # camera_info
    "kalibr": "app.formats.kalibr:Kalibr",  # a camchain of one camera
    "mrcal": "app.formats.mrcal:Mrcal",  # .cameramodel, lens and pose
    "photonvision": "app.formats.photonvision:PhotonVision",  # one resolution's calibration
    "ssl-vision": "app.formats.ssl_vision:SslVision",  # the league's geometry packet: lens, pose and field
    "npz": "app.formats.npz_file:NpzFile",  # a remap table: correct pictures with numpy and OpenCV alone
    "csv": "app.formats.csv_points:CsvPoints",  # clicks and a grid of positions, for spreadsheets
})
