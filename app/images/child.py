"""The process that decodes, and may die: bytes in over a socket, an answer and bare pixels out.

It is started by path and imports nothing of ours, so that all it holds is OpenCV and one stranger's picture.
Each request is REQUEST, then the bytes; each answer is ANSWER, then height × width × 3 bytes of BGR where
the status is DECODED. Nothing is pickled: the caller reads a fixed number of bytes and never an object.
"""

import contextlib
import resource
import signal
import socket
import struct
import sys

REQUEST = struct.Struct("<QIId")  # bytes that follow, declared width and height, wall limit in s
ANSWER = struct.Struct("<BII")  # status, width, height
READY, DECODED, UNDECODABLE, OTHER_SIZE, OUT_OF_MEMORY = range(5)


def main() -> None:
    """Answer requests on standard input, a socket, until it closes; argument 1 is the address space in bytes."""
    line = socket.socket(fileno=0)
    decode = _decoder()
    _confine(memory_bytes=int(sys.argv[1]))
    line.sendall(ANSWER.pack(READY, 0, 0))
    while True:
        length, width, height, wall_s = REQUEST.unpack(_read(line, REQUEST.size))
        data = _read(line, length)
        # The caller kills a slow child; this alarm ends one whose caller has been killed itself.
        signal.setitimer(signal.ITIMER_REAL, wall_s + 1.0)
        status, pixels = decode(data, width, height)
        del data
        signal.setitimer(signal.ITIMER_REAL, 0)
        found_height, found_width = (0, 0) if pixels is None else pixels.shape[:2]
        line.sendall(ANSWER.pack(status, found_width, found_height))
        if status == DECODED:
            line.sendall(memoryview(pixels).cast("B"))
        del pixels  # or it would lie beside the next one


def _decoder():
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    for log in ("utils", ""):
        with contextlib.suppress(AttributeError):
            getattr(cv2, log, cv2).setLogLevel(0)
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    for suffix in (".png", ".jpg", ".bmp", ".webp"):  # warm: codecs allocate on first use
        cv2.imdecode(cv2.imencode(suffix, np.zeros((16, 16, 3), np.uint8))[1], flags)

    def decode(data: bytearray, width: int, height: int):
        try:
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        except MemoryError:
            return OUT_OF_MEMORY, None
        except cv2.error as error:
            return (OUT_OF_MEMORY if error.code == cv2.Error.StsNoMem else UNDECODABLE), None
        if pixels is None:
            return UNDECODABLE, None
        if pixels.shape != (height, width, 3) or pixels.dtype != np.uint8:
            return OTHER_SIZE, pixels
        return DECODED, np.ascontiguousarray(pixels)

    return decode


def _confine(memory_bytes: int) -> None:
    """Little memory, no file written, no core dump, and nothing opened or started from here on."""
    for what, most in ((resource.RLIMIT_AS, memory_bytes), (resource.RLIMIT_FSIZE, 0), (resource.RLIMIT_CORE, 0),
                       (resource.RLIMIT_NOFILE, 3)):
        _, hard = resource.getrlimit(what)
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (limit, limit))


def _read(line: socket.socket, length: int) -> bytearray:
    """Exactly that many bytes; the process ends quietly where the caller has gone."""
    data = bytearray(length)
    view, done = memoryview(data), 0
    while done < length:
        received = line.recv_into(view[done:])
        if received == 0:
            sys.exit(0)
        done += received
    return data


if __name__ == "__main__":
    main()
