"""Errors of network cameras, the same for HTTP and RTSP."""

from app.core.errors import Unavailable


def status_error(status: int, scheme: str, nothing_there: str, path: str) -> Unavailable:
    """Return the error for a status. scheme: "http" or "rtsp"; nothing_there, path: what 404 means, and its remedy."""
    if 300 <= status < 400:
        return Unavailable("The camera redirects to another address.", "Enter that address.",
                           reason="camera-redirects")
    if status in (401, 403):
        return Unavailable("The camera does not accept the user name and password.",
                           f"Enter them as {scheme}://user:password@host/…", reason="camera-login")
    if status == 404:
        return Unavailable(f"The camera has {nothing_there} under this path.",
                           f"See its manual for its {path} path.", reason="unknown-stream")
    return Unavailable(f"The camera refused the request with {scheme.upper()} status {status}.",
                       "Check its settings, or restart it.", reason="camera-refuses")


def silent() -> Unavailable:
    return Unavailable("The camera no longer sends images.", "Check the camera and its network.",
                       reason="camera-silent")


def connection_lost() -> Unavailable:
    return Unavailable("The connection to the camera was lost.", "Check that it is switched on.", reason="camera-gone")
