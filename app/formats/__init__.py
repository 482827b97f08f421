"""What a calibration is written to, and read from: a table of formats, one file each.

A format is a class with NAME, TITLE, MEDIA_TYPE, SUFFIX and HOLDS, what it can hold in a sentence. Two kinds:

    whole      `write(calibration) -> bytes`: every model.
    a lens     LENSES, the terms it knows by model, SQUARE_PIXELS, and `write(calibration, held) -> bytes`: holding.py
               says which camera it is given, the calibration's own or the nearest that the format can hold.

One that can be read back has `recognises(data)`, by a look, and `read(data)`, which checks everything and gives a
Calibration (ours), a CameraFile (a lens, with a pose where the file tells of a field) or Observations (points), and
never anything but a TouchlineError for other bytes. To add one: write app/formats/NAME.py and its line here; the tests
walk the table, with golden files of every model that it holds.
"""

from typing import ClassVar, Protocol

from app.core.registry import Registry


class Export(Protocol):
    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    MEDIA_TYPE: ClassVar[str]
    SUFFIX: ClassVar[str]
    HOLDS: ClassVar[str]


EXPORTS = Registry("export format", {
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
