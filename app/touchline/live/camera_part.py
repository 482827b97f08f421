"""What a capability adds to a camera's process: work of its own on the frames, and answers to requests."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from touchline.core.json_values import JsonObject
from touchline.images import ImageLimits
from touchline.live.capture import FrameCapture
from touchline.live.failures import Failures
from touchline.live.messages import StreamSpec
from touchline.live.picture import AppliedCalibration

# its values → the answer's JSON and payload
Request = Callable[[JsonObject], tuple[JsonObject, bytes]]


@dataclass(frozen=True)
class PartContext:
    """What a part works with.

    send: a message's body to its other half in the server, its CameraFeed. send_picture: a picture of that stream's
    number, as a viewer receives it. failures: where it reports what went wrong without ending it.
    """

    capture: FrameCapture
    send: Callable[[bytes], None]
    send_picture: Callable[[int, bytes], None]
    failures: Failures
    limits: ImageLimits


class CameraPart:
    """Made with a PartContext, in the camera's process; a part overrides what it needs.

    requests: what the server can ask for, by name. threads: functions that work until the process ends.
    """

    requests: Mapping[str, Request] = {}
    threads: Sequence[Callable[[], None]] = ()

    def apply(self, calibration: AppliedCalibration | None, picture: JsonObject | None) -> None:
        """Work with this calibration from now on. picture: {"name", "path", "sha256"} of the one it was made from."""

    def watch(self, streams: Mapping[int, tuple[StreamSpec, float]]) -> None:
        """Draw these streams, of views that are none of the camera's own, each at least so many seconds apart."""

    def follow(self, settings: JsonObject) -> None:
        """Do from now on what the settings() of its CameraFeed say."""

    def status(self) -> JsonObject:
        """Return its entries of the process's report."""
        return {}
