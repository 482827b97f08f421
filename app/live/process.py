"""A camera's process seen from the server's event loop."""

from app.processes.async_process import AsyncProcess
from app.processes.start import Program

MEMORY_BYTES = 6 << 30  # of addresses; FFmpeg and camera libraries reserve much more than they use


class CameraProcess(AsyncProcess):
    """What a camera sends is a stranger's, and may make this process die, never the server."""

    PROGRAM = Program("app.live.worker_main:main", MEMORY_BYTES)
    START_S = 30.0  # importing OpenCV takes 0.3 s, on a busy small machine some seconds
    CANNOT_START = "The camera's process cannot be started.", "Free some memory.", "camera-process"
    NOT_READY = "The camera's process does not start.", "Free some memory, or reinstall Touchline.", "camera-process"
    SILENT = "The camera does not answer.", "Look at its state, then try again.", "camera-silent"
    ENDED = "The camera's process was ended.", "Try again in a moment.", "camera-silent"
