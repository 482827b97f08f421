"""Parts of a camera's process, as a package beside Touchline may have them."""

from touchline.live.camera_part import CameraPart, PartContext


class CountingPart(CameraPart):
    """Says which frame is the newest, when it is asked and in its report."""

    def __init__(self, around: PartContext) -> None:
        self._capture = around.capture
        self.requests = {"newest": lambda asked: ({"seq": self._capture.next(asked["after"], 10.0).seq}, b"bytes")}

    def status(self):
        return {"counted": self._capture.status()["seq"]}


class NeverStarted(CameraPart):
    """Cannot be made."""

    def __init__(self, around: PartContext) -> None:
        raise MemoryError


class AlwaysFailing(CameraPart):
    """Fails in all that it is asked for."""

    def __init__(self, around: PartContext) -> None:
        self.threads = ()

    def apply(self, calibration, picture):
        raise ValueError

    def watch(self, streams):
        raise ValueError

    def follow(self, request):
        raise ValueError

    def status(self):
        raise ValueError
