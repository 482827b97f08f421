"""From pictures of a board to a lens and its report.

    view = find(frame.pixels, board)                for every picture
    answer = calibrate_board(views, board, image_size, "brown-conrady")
    answer["lens"]                                  fixed in a later fit: {"name": answer["model"], "lens": …}
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.board import Board, BoardView
from app.core.errors import FitFailed
from app.core.geometry import ImageSize
from app.core.progress import Progress, no_progress
from app.core.text_format import sentence
from app.evaluate.board.report import board_report
from app.fitting.board.fit import board_model, fit_board
from app.vision.board.detection import find_board

FITTING = 0.7  # of the whole calibration's time


def find(pixels: NDArray[np.uint8], board: Board, name: str = "") -> BoardView:
    """Find the board in one picture; FitFailed where there is none."""
    view = find_board(pixels, board, name)
    if view is None:
        raise FitFailed(sentence(f"{name or 'The picture'} shows no {board.kind} of {board.columns} × {board.rows} "
                                 "inner corners."),
                        "Count the inner corners again; the whole board must be in the picture, sharp and unhidden."
                        if board.kind == "chessboard" else
                        "Check columns, rows and dictionary, and whether the board is an old one (legacy).",
                        reason="no-board")
    return view


def calibrate_board(views: Sequence[BoardView], board: Board | None, image_size: ImageSize,
                    model: str = "brown-conrady", options: Mapping[str, Any] | None = None,
                    progress: Progress = no_progress) -> dict[str, Any]:
    """{"model", "lens", "board", "image_size", "report"}, plain JSON. board: None where views bring their places."""
    fit = fit_board(tuple(views), image_size, board_model(model), options,
                    lambda fraction, message: progress(fraction * FITTING, message))
    progress(FITTING, "Judging it")
    report = board_report(fit)
    progress(1.0, "Done")
    return {"model": model, "lens": fit.lens.to_json(), "board": board.to_json() if board else None,
            "image_size": [image_size.width, image_size.height], "report": report}
