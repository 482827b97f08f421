"""Work in the data folder that is killed at a given line of the store's code, in a forked process."""

import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

STORE = str(Path("touchline") / "store")
FOREVER_S = 120


def is_killed_at(line: int, work: Callable[..., object], *given: object) -> bool:
    """Run the work until the store has run so many lines of its own code; False where it was done before that."""
    process = os.fork()
    if process == 0:
        signal.alarm(FOREVER_S)
        try:
            _run(line, work, given)
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    if code not in (0, -signal.SIGKILL):
        raise AssertionError(f"the work ended with {code}")
    return code != 0


def _run(left: int, work: Callable[..., object], given: tuple[object, ...]) -> None:
    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal left
        if event == "call":
            return trace if STORE in frame.f_code.co_filename else None
        left -= event == "line"
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return trace

    sys.settrace(trace)
    work(*given)
    sys.settrace(None)
