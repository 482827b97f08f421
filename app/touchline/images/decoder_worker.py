"""The process that decodes, and may die: bytes in over a socket, an answer and bare pixels out.

All that it holds is OpenCV and one stranger's picture. Each DECODE is REQUEST, then the bytes; its answer is DECODED
with height × width × 3 bytes of BGR, or one of the others. The caller reads a fixed number of bytes, never an object.
"""

import contextlib
import signal
import struct
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from touchline.processes.framing import FIRST_KIND, START, Connection, encode_body
from touchline.processes.limits import limit

REQUEST = struct.Struct("<IId")  # declared width and height, wall limit in s
SIZE = struct.Struct("<II")  # OTHER_SIZE: the width and height that were found
DECODE, DECODED, UNDECODABLE, OTHER_SIZE, OUT_OF_MEMORY = range(FIRST_KIND, FIRST_KIND + 5)


def main(connection: Connection, arguments: dict[str, Any]) -> None:
    """Decode until the caller goes. arguments: {"memory_bytes"} of address space."""
    decode = _decoder()
    limit(arguments["memory_bytes"], sealed=True)
    connection.send(START, 0, encode_body({}))
    while True:
        body = connection.receive().body
        width, height, wall_s = REQUEST.unpack_from(body)
        # The caller kills a slow child; this alarm ends one whose caller has been killed itself.
        signal.setitimer(signal.ITIMER_REAL, wall_s + 1.0)
        status, answer = decode(body, width, height)
        del body
        signal.setitimer(signal.ITIMER_REAL, 0)
        connection.send(status, 0, answer)
        del answer  # or it would lie beside the next one


def _decoder() -> Callable[[bytearray, int, int], tuple[int, bytes | memoryview]]:
    for log in ("utils", ""):
        with contextlib.suppress(AttributeError):
            getattr(cv2, log, cv2).setLogLevel(0)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    for suffix in (".png", ".jpg", ".bmp", ".webp"):  # warm: codecs allocate on first use
        cv2.imdecode(cv2.imencode(suffix, np.zeros((16, 16, 3), np.uint8))[1], flags)

    def decode(body: bytearray, width: int, height: int) -> tuple[int, bytes | memoryview]:
        try:
            pixels = cv2.imdecode(np.frombuffer(body, np.uint8, offset=REQUEST.size), flags)
        except MemoryError:
            return OUT_OF_MEMORY, b""
        except cv2.error as error:
            return (OUT_OF_MEMORY if error.code == cv2.Error.StsNoMem else UNDECODABLE), b""
        if pixels is None:
            return UNDECODABLE, b""
        if pixels.shape != (height, width, 3) or pixels.dtype != np.uint8:
            return OTHER_SIZE, SIZE.pack(pixels.shape[1], pixels.shape[0])
        return DECODED, np.ascontiguousarray(pixels).data.cast("B")

    return decode
