"""The picture of a report, as it is stored."""

from collections.abc import Callable

from touchline.core.errors import BadImage, NotFound
from touchline.core.records import Calibration, Frame
from touchline.report.contents import ReportPicture
from touchline.store.quarantine import DamagedFile


def report_picture(
    calibration: Calibration, frame_of: Callable[[str], Frame], camera_name: str | None = None
) -> ReportPicture:
    """Load the picture that was clicked, if it is still stored. frame_of: returns it by its id."""
    if calibration.snapshot is None:
        return ReportPicture(
            None,
            "The calibration has no image: it was imported, or made from points alone.",
            camera_name,
        )
    try:
        return ReportPicture(frame_of(calibration.snapshot), camera_name=camera_name)
    except (NotFound, DamagedFile, BadImage) as refusal:
        return ReportPicture(None, f"The image cannot be shown: {refusal.what}", camera_name)
