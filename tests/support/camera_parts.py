"""Parts of a camera's process, as a package beside Touchline may have them."""

from touchline.core.errors import BadInput
from touchline.live.camera_feed import CameraFeed
from touchline.live.camera_part import CameraPart, PartContext
from touchline.processes.framing import encode_body


class CountingPart(CameraPart):
    """Says which frame is the newest, when it is asked and in its report."""

    def __init__(self, around: PartContext) -> None:
        self._capture = around.capture
        self.requests = {
            "newest": lambda asked: (
                {"seq": self._capture.next(asked["after"], 10.0).seq},
                b"bytes",
            )
        }

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

    def follow(self, settings):
        raise ValueError

    def status(self):
        raise ValueError


class EchoingPart(CameraPart):
    """Sends what it is to follow back to its feed, and says so in its report."""

    def __init__(self, around: PartContext) -> None:
        self._send = around.send
        self._followed: dict[str, object] = {}

    def follow(self, settings):
        self._followed = settings
        self._send(encode_body({"followed": settings}))

    def status(self):
        return {"echoed": self._followed}


class EchoFeed(CameraFeed):
    NAME = "echo"
    echoed = None

    def settings(self):
        return {"viewers": len(self.viewers)}

    def update_status(self, status):
        self.echoed = status.get("echoed")


class NeverMade(CameraFeed):
    def __init__(self, services, camera, changed):
        raise MemoryError


class FailingFeed(CameraFeed):
    """Fails in all that the camera tells it."""

    NAME = "failing"

    def refresh(self):
        raise BadInput("No.", "Nothing.")

    def settings(self):
        if self.viewers:
            raise ValueError
        return {}

    def receive(self, body):
        raise BadInput("No.", "Nothing.")

    def end(self, why):
        raise ValueError

    def update_status(self, status):
        raise ValueError
