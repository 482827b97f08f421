"""Errors of network cameras, the same for HTTP and RTSP."""

from touchline.core.errors import Unavailable
from touchline.core.sentences import SENDS_NO_IMAGES
from touchline.core.statements import say

CHECK_SWITCHED_ON = say("network.check-switched-on", "Check that it is switched on.")
NOTHING_THERE = {"http": say("network.no-answer-at-path", "The camera has nothing under this path."),
                 "rtsp": say("network.no-stream-at-path", "The camera has no stream under this path.")}
PATHS = {"http": "MJPEG", "rtsp": "RTSP"}


def status_error(status: int, scheme: str) -> Unavailable:
    """Return the error for a status. scheme: "http" or "rtsp"."""
    if 300 <= status < 400:
        return Unavailable(say("network.redirects", "The camera redirects to another address."),
                           say("network.enter-that-address", "Enter that address."), reason="camera-redirects")
    if status in (401, 403):
        return Unavailable(say("network.login-refused", "The camera does not accept the user name and password."),
                           say("network.enter-login", "Enter them as {scheme}://user:password@host/…", scheme=scheme),
                           reason="camera-login")
    if status == 404:
        return Unavailable(NOTHING_THERE[scheme], say("network.see-manual", "See its manual for its {protocol} path.",
                                                      protocol=PATHS[scheme]), reason="unknown-stream")
    return Unavailable(say("network.refused", "The camera refused the request with {protocol} status {status}.",
                           protocol=scheme.upper(), status=status),
                       say("network.check-settings", "Check its settings, or restart it."), reason="camera-refuses")


def silent() -> Unavailable:
    return Unavailable(SENDS_NO_IMAGES, say("network.check-network", "Check the camera and its network."),
                       reason="camera-silent")


def connection_lost() -> Unavailable:
    return Unavailable(say("network.connection-lost", "The connection to the camera was lost."), CHECK_SWITCHED_ON,
                       reason="camera-gone")
