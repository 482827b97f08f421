"""A board before a live camera: which of the frames that show it are worth a picture, by themselves.

    seen → still for STILL_S → like none that was taken → take

The camera's process looks for the board, on a thread that gives way to the picture; whoever holds the board is shown
what is seen, what is covered, and what is needed next.
"""

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from touchline.core.board import Board
from touchline.core.geometry import ImageSize
from touchline.core.statements import say
from touchline.evaluate.board.poses import BoardPose, PoseHistory, pose_history
from touchline.live.camera_part import CameraPart, PartContext
from touchline.live.capture import FrameCapture
from touchline.processes.limits import give_way
from touchline.vision.board.detection import find_board_quickly

WAIT_S = 2.0  # for the next frame
STILL_S = 0.4  # longer than anybody's hand turns round in
MAX_STILL_SHARE = 0.003  # of the picture's width, within STILL_S: 2 px of 640
MAX_VIEWS = 100
NICE = 10  # niceness: the picture goes first
NO_BOARD = say("board.not-detected", "No board detected. Show the whole board in good light.")
HOLD_STILL = say("board.hold-still", "Hold the board still.")
OTHER_POSE = say("board.other-pose", "This pose is already captured. Move or tilt the board.")


class BoardPart(CameraPart):
    """Boards before the camera, in its process."""

    def __init__(self, around: PartContext) -> None:
        self.requests = {"board": lambda asked: (find_board(around.capture, asked["board"], asked["after"]), b"")}


def find_board(capture: FrameCapture, board: dict[str, Any], after: int) -> dict[str, Any]:
    """In the camera's process: return the next frame's board, plain JSON. quad: None where none was found."""
    give_way(NICE)  # this thread ends with this answer
    taken = capture.next(after, WAIT_S)
    begun, which = time.monotonic(), Board.from_json(board)
    view = find_board_quickly(taken.frame.pixels, which)
    size = taken.frame.size
    pose = None if view is None else BoardPose.of(view, which, size)
    return {"seq": taken.seq, "time": taken.time, "width": size.width, "height": size.height,
            "corners": [] if view is None else np.round(view.pixels, 1).tolist(),
            "quad": None if pose is None else pose.quad.tolist(), "took_s": time.monotonic() - begun}


@dataclass
class BoardCapture:
    """What was seen so far of one board, in pictures of one size."""

    board: Board
    size: ImageSize
    poses: list[BoardPose] = field(default_factory=list)
    _before: list[tuple[float, BoardPose]] = field(default_factory=list)
    _held: PoseHistory | None = None

    def update(self, quad: Any, now_s: float) -> dict[str, Any]:
        """Return whether it is still, whether it is new, and in words what hinders a picture ("" nothing)."""
        pose = None if quad is None else BoardPose.from_points(quad, self.size)
        if pose is None:
            self._before.clear()
            return {"still": False, "new": False, "hint": NO_BOARD}
        self._before = [(then, other) for then, other in self._before
                        if pose.moved_px(other) <= MAX_STILL_SHARE * self.size.width]
        still = bool(self._before) and now_s - self._before[0][0] >= STILL_S
        self._before.append((now_s, pose))
        new = not any(pose.is_like(other) for other in self.poses)
        return {"still": still, "new": new, "hint": "" if still and new else HOLD_STILL if new else OTHER_POSE}

    def add_view(self, quad: Any) -> None:
        """Note that this view was taken."""
        if len(self.poses) < MAX_VIEWS:
            self.poses.append(BoardPose.from_points(quad, self.size))
        self._held = None
        self._before.clear()

    @property
    def is_full(self) -> bool:
        return len(self.poses) >= MAX_VIEWS

    @property
    def coverage(self) -> PoseHistory:
        if self._held is None:
            self._held = pose_history(self.poses, self.board, self.size)
        return self._held
