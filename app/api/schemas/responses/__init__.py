"""What answers look like, for the documentation: the routes send their JSON as it is, tests hold it to this.

One file for each resource; routes take every name from here.
"""

from app.api.schemas.responses.base import Answer, Health, Job, Jobs, Page
from app.api.schemas.responses.calibrations import (
    Calibration,
    CalibrationReport,
    Calibrations,
    Difference,
    Format,
    Formats,
    Ranking,
    Transformed,
    Uncertainty,
)
from app.api.schemas.responses.cameras import (
    Camera,
    Cameras,
    CameraStatus,
    CameraTest,
    Controls,
    FoundCameras,
    Snapshot,
    Snapshots,
    Sources,
)
from app.api.schemas.responses.fits import (
    Arrows,
    Border,
    Draft,
    Drawn,
    Field,
    Fields,
    FittedModel,
    Model,
    Models,
    Option,
    Overlay,
    Preview,
    Report,
    SnappedPoints,
)
from app.api.schemas.responses.lenses import Lens, Lenses, LensInShort, Pair, PairLines, Straightness

__all__ = [
    "Answer", "Arrows", "Border", "Calibration", "CalibrationReport", "Calibrations", "Camera", "CameraStatus",
    "CameraTest", "Cameras", "Controls", "Difference", "Draft", "Drawn", "Field", "Fields", "FittedModel",
    "Format", "Formats", "FoundCameras", "Health", "Job", "Jobs", "Lens", "LensInShort", "Lenses", "Model",
    "Models", "Option", "Overlay", "Page", "Pair", "PairLines", "Preview", "Ranking", "Report", "SnappedPoints",
    "Snapshot", "Snapshots", "Sources", "Straightness", "Transformed", "Uncertainty",
]
