"""In a camera's process: one picture to keep, exact to the bit; of one frame, or the background of many."""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import Unavailable
from touchline.core.sentences import REPEAT, SERIES_MOVED, SERIES_MOVED_FIX
from touchline.core.statements import say
from touchline.images import encode
from touchline.live.capture import CapturedFrame, FrameCapture
from touchline.vision.motion.background import Background
from touchline.vision.motion.stillness import camera_shift_px

MAX_FRAMES = 60
STILL_PX = 1.0  # a camera that stands seems to move by a third of it


def take_still(capture: FrameCapture, frames: int, over_s: float, timeout_s: float) -> tuple[dict[str, Any], bytes]:
    """Return the next frame, or what most of so many agree on that are spread over so long; a PNG.

    The JSON says how many frames went in, when the first and last were taken, and which share of the pixels was never
    seen free of moving things. Unavailable where frames do not come, and where the camera moved meanwhile.
    """
    deadline = time.monotonic() + timeout_s
    first = last = capture.next(capture.status()["seq"], timeout_s)
    if frames <= 1:
        return _description(first, last, 1, None), encode(first.frame.pixels, "png")
    background = Background(first.frame.pixels.shape, min(frames, MAX_FRAMES))
    background.add(first.frame.pixels)
    count, begun, frames = 1, first.moment, min(frames, MAX_FRAMES)
    while count < frames:
        # Who walks by needs some seconds to leave: frames that follow each other would all show them.
        time.sleep(max(0.0, begun + over_s * count / (frames - 1) - time.monotonic()))
        taken = capture.next(last.seq, max(0.0, deadline - time.monotonic()))
        if taken.frame.pixels.shape != first.frame.pixels.shape:
            raise Unavailable(say("image.size-changed", "The image size changed while the image was taken."),
                              REPEAT, reason="size-changed")
        if camera_shift_px(first.frame.pixels, taken.frame.pixels) > STILL_PX:
            raise Unavailable(SERIES_MOVED, SERIES_MOVED_FIX, reason="series-moved")
        last = taken
        background.add(taken.frame.pixels)
        count += 1
    return _description(first, last, count, background.unsettled), encode(background.picture, "png")


def _description(first: CapturedFrame, last: CapturedFrame, count: int,
                 unsettled: NDArray[np.bool_] | None) -> dict[str, Any]:
    size = first.frame.size
    return {"frames": count, "seq": last.seq, "time": first.time, "until": last.time, "width": size.width,
            "height": size.height, "hidden_share": None if unsettled is None else float(np.mean(unsettled))}
