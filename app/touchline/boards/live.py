"""In a camera's process: where a board is in the newest frame, on a thread that gives way to the picture."""

import time

import numpy as np

from touchline.boards.board import Board, find_board_quickly
from touchline.boards.poses import BoardPose
from touchline.core.json_values import JsonObject
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.capture import FrameCapture
from touchline.processes.limits import give_way

WAIT_S = 2.0  # for the next frame
NICE = 10  # niceness: the picture goes first


class BoardPart(CameraPart):
    """Detects boards before the camera."""

    def __init__(self, around: PartContext) -> None:
        self.requests = {
            "board": lambda request: (
                detect_board(around.capture, Board.from_json(request["board"]), request["after"]),
                b"",
            )
        }


def detect_board(capture: FrameCapture, board: Board, after: int) -> JsonObject:
    """Return the board in the next frame, plain JSON. after: number of the frame before; quad: None without a board."""
    give_way(NICE)  # this thread ends with this answer
    taken = capture.next(after, WAIT_S)
    start_s = time.monotonic()
    view = find_board_quickly(taken.frame.pixels, board)
    size = taken.frame.size
    pose = None if view is None else BoardPose.of(view, board, size)
    return {
        "seq": taken.seq,
        "time": taken.time,
        "width": size.width,
        "height": size.height,
        "corners": [] if view is None else np.round(view.pixels, 1).tolist(),
        "quad": None if pose is None else pose.quad.tolist(),
        "took_s": time.monotonic() - start_s,
    }
