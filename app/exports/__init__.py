"""What a calibration is written to, and read from: a table of formats, one file each.

A format is a class with NAME, TITLE, MEDIA_TYPE, SUFFIX and `write(calibration) -> bytes`; one that can be read back
also has `read(data) -> Calibration`. A format that cannot hold the calibration's model raises Conflict and says what
to do instead. To add one: write app/exports/NAME.py and its line here; the tests walk the table.
"""

from typing import ClassVar, Protocol

from app.records import Calibration
from app.registry import Registry


class Export(Protocol):
    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    MEDIA_TYPE: ClassVar[str]
    SUFFIX: ClassVar[str]

    @staticmethod
    def write(calibration: Calibration) -> bytes: ...


EXPORTS = Registry("export format", {
    "json": "app.exports.json_file:JsonFile",  # ours, complete, read back exactly
    "npz": "app.exports.npz_file:NpzFile",  # a remap table: correct pictures with numpy and OpenCV alone
})
