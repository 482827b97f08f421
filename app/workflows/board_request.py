"""A request for a lens, from pictures of a board or from corners found elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field as member
from typing import Any, Self

from app import __version__
from app.core.board import Board, BoardView, views_from_json
from app.core.errors import BadInput, Conflict, FitFailed
from app.core.geometry import ImageSize
from app.core.options import read_options
from app.core.progress import Progress, no_progress
from app.core.records import Warning
from app.core.text_format import sentence
from app.fitting.board.fit import board_model, board_options
from app.workflows import board
from app.workflows.calibration import subprogress
from app.workflows.job_pictures import Pictures, job_pictures

LOOKING = 0.6  # of a calibration from pictures: finding the board takes longer than all arithmetic


@dataclass(frozen=True, eq=False)
class BoardCalibrationRequest:
    """The board, model and options. board: None where views carry object points of their own."""

    board: Board | None
    model: str = "brown-conrady"
    options: Mapping[str, Any] = member(default_factory=dict)

    def __post_init__(self) -> None:
        read_options(board_options(board_model(self.model)), self.options)  # refused before a job starts

    def from_views(self, views: tuple[BoardView, ...], size: ImageSize, progress: Progress = no_progress,
                   ) -> dict[str, Any]:
        """Fit views; return the lens with its report as JSON, not yet stored."""
        done = board.calibrate_board(views, self.board, size, self.model, self.options, progress)
        return {**done, "software": f"touchline {__version__}"}

    def from_pictures(self, pictures: Pictures, progress: Progress = no_progress) -> dict[str, Any]:
        """Find the board in pictures of one size and fit. A picture without a board is left out, with a warning."""
        if self.board is None:
            raise BadInput("No board is given.", "Say what the pictures show: kind, columns, rows and square_mm.",
                           reason="no-board")
        views, blank, size, count = [], [], None, len(pictures)
        for number, (name, read) in enumerate(pictures):
            progress(LOOKING * number / count, f"Looking for the board in {name} ({number + 1} of {count})")
            frame = read()
            size = size or frame.size
            if frame.size != size:
                raise Conflict(sentence(f"{name} is {frame.size}, the ones before are {size}."),
                               "Take all pictures with one camera at one size.", reason="size-mismatch")
            try:
                views.append(board.find(frame.pixels, self.board, name))
            except FitFailed as none:
                blank.append((number, none))
        if size is None or not views:
            raise blank[0][1] if blank else BadInput("There are no pictures.", "Give about twenty pictures of the "
                                                     "board.", reason="too-few-views")
        done = self.from_views(tuple(views), size, subprogress(progress, LOOKING, 1.0))
        warnings = [Warning(none.reason, none.what, none.fix, index=number).to_json() for number, none in blank]
        return {**done, "report": {**done["report"], "warnings": [*done["report"]["warnings"], *warnings]}}

    def to_json(self) -> dict[str, Any]:
        return {"board": self.board.to_json() if self.board else None, "model": self.model,
                "options": dict(self.options)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        board = None if value["board"] is None else Board.from_json(value["board"])
        return cls(board, value["model"], value["options"])


def run_views(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"task", "views", "image_size"}."""
    request = BoardCalibrationRequest.from_json(spec["task"])
    return request.from_views(views_from_json(spec["views"]), ImageSize.of(spec["image_size"]), progress)


def run_pictures(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"task", "pictures": [{"name", "path", "sha256"}, …]}; untrusted, decoded in a child."""
    with job_pictures(spec["pictures"]) as pictures:
        return BoardCalibrationRequest.from_json(spec["task"]).from_pictures(pictures, progress)
