"""A lens from images of a board, or from corners found elsewhere, with its report.

view = require_board(frame.pixels, board)       for every image
answer = calibrate_board(views, board, image_size, "brown-conrady")
answer["lens"]                                  fixed in a later fit: {"name": answer["model"], "lens": …}
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as member
from typing import Any, Self

from touchline.boards.board import Board, BoardView, find_board, views_from_json
from touchline.boards.fit import board_model, board_options, fit_board
from touchline.boards.report import board_report
from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.json_values import JsonObject
from touchline.core.options import read_options
from touchline.core.records import Warning
from touchline.core.sentences import PROGRESS_DONE, image_name, previous_images_differ
from touchline.core.statements import say, sentence
from touchline.installation import __version__
from touchline.workflows.job_pictures import Pictures, job_pictures

FITTING_SHARE = 0.7  # of the time of a calibration from views
DETECTION_SHARE = 0.6  # of one from images: finding the board takes longer than all arithmetic
COUNT_CORNERS = say(
    "board.count-corners",
    "Count the inner corners again. The whole board must be visible and sharp in the image.",
)
CHECK_KIND = say(
    "board.check-kind",
    "Check columns, rows and dictionary, and whether the board has the legacy pattern.",
)


def require_board(pixels: Pixels, board: Board, name: str = "") -> BoardView:
    """Find the board in one image; FitFailed where there is none."""
    view = find_board(pixels, board, name)
    if view is None:
        raise FitFailed(
            say(
                "board.not-in-image",
                "{image} shows no {kind} of {columns} × {rows} inner corners.",
                image=image_name(sentence(name)) if name else say("board.the-image", "The image"),
                kind=say(f"board-kind.{board.kind}", board.kind),
                columns=board.columns,
                rows=board.rows,
            ),
            COUNT_CORNERS if board.kind == "chessboard" else CHECK_KIND,
            reason="no-board",
        )
    return view


def calibrate_board(
    views: Sequence[BoardView],
    board: Board | None,
    image_size: ImageSize,
    model: str = "brown-conrady",
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> JsonObject:
    """Return {"model", "lens", "board", "image_size", "report"}, plain JSON.

    board: None where views bring their places.
    """
    fit = fit_board(
        tuple(views),
        image_size,
        board_model(model),
        options,
        lambda fraction, message: progress(fraction * FITTING_SHARE, message),
    )
    progress(FITTING_SHARE, say("progress.evaluating-lens", "Evaluating the lens"))
    report = board_report(fit)
    progress(1.0, PROGRESS_DONE)
    return {
        "model": model,
        "lens": fit.lens.to_json(),
        "board": board.to_json() if board else None,
        "image_size": [image_size.width, image_size.height],
        "report": report,
    }


@dataclass(frozen=True, eq=False)
class BoardCalibrationRequest:
    """The board, model and options. board: None where views carry object points of their own."""

    board: Board | None
    model: str = "brown-conrady"
    options: Mapping[str, Any] = member(default_factory=dict)

    def __post_init__(self) -> None:
        # refused before a job starts
        read_options(board_options(board_model(self.model)), self.options)

    def from_views(
        self, views: tuple[BoardView, ...], size: ImageSize, progress: Progress = no_progress
    ) -> JsonObject:
        """Fit views; return the lens with its report as JSON, not yet stored."""
        found = calibrate_board(views, self.board, size, self.model, self.options, progress)
        return {**found, "software": f"touchline {__version__}"}

    def from_pictures(self, pictures: Pictures, progress: Progress = no_progress) -> JsonObject:
        """Find the board in pictures of one size and fit. A picture without a board is left out, with a warning."""
        if self.board is None:
            raise BadInput(
                say("board.missing", "The board is missing."),
                say(
                    "board.enter",
                    "Enter the board in the images: kind, columns, rows and square_mm.",
                ),
                reason="no-board",
            )
        views, without_board, size, count = [], [], None, len(pictures)
        for index, (name, read) in enumerate(pictures):
            progress(
                DETECTION_SHARE * index / count,
                say(
                    "progress.board",
                    "Detecting the board in {image} ({number} of {count})",
                    image=image_name(name),
                    number=index + 1,
                    count=count,
                ),
            )
            frame = read()
            size = size or frame.size
            if frame.size != size:
                raise Conflict(
                    previous_images_differ(name, frame.size, size),
                    say(
                        "board.one-resolution", "Take all images with one camera at one resolution."
                    ),
                    reason="size-mismatch",
                )
            try:
                views.append(require_board(frame.pixels, self.board, name))
            except FitFailed as error:
                without_board.append((index, error))
        if size is None or not views:
            raise (
                without_board[0][1]
                if without_board
                else BadInput(
                    say("board.no-images", "There are no images."),
                    say("board.use-images", "Use about 20 images of the board."),
                    reason="too-few-views",
                )
            )
        found = self.from_views(tuple(views), size, subprogress(progress, DETECTION_SHARE, 1.0))
        found["report"]["warnings"] += [
            Warning(error.reason, error.what, error.fix, index=index).to_json()
            for index, error in without_board
        ]
        return found

    def to_json(self) -> JsonObject:
        return {
            "board": self.board.to_json() if self.board else None,
            "model": self.model,
            "options": dict(self.options),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        board = None if value["board"] is None else Board.from_json(value["board"])
        return cls(board, value["model"], value["options"])


def run_views(spec: Any, progress: Progress) -> JsonObject:
    """Run a job: {"task", "views", "image_size"}."""
    request = BoardCalibrationRequest.from_json(spec["task"])
    return request.from_views(
        views_from_json(spec["views"]), ImageSize.of(spec["image_size"]), progress
    )


def run_pictures(spec: Any, progress: Progress) -> JsonObject:
    """Run a job: {"task", "pictures": [{"name", "path", "sha256"}, …]}; untrusted, decoded in a child."""
    with job_pictures(spec["pictures"]) as pictures:
        return BoardCalibrationRequest.from_json(spec["task"]).from_pictures(pictures, progress)
