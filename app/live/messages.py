"""What the server and a camera's process say to each other: HEADER (kind, number, how many bytes), then a body.

A body is a *message*: little-endian uint32, that many bytes of JSON, then bytes of its own (a JPEG, a PNG, nothing).
A PICTURE's body is byte for byte what a viewer's WebSocket receives, so that the server hands it on without a look.

To the process: OPEN {"around"…} once, WATCH {"channels": […]} (number: ignored), SHOW {"calibration", "picture": … |
null} with the picture that it came from, SEE {"plan", "profile", …} (seeing.py), ASK {"what", …} (number: of the
question). From it: READY once, STATUS, PICTURE (number: of the channel), SEEN with a packet of the league or nothing,
ANSWER (number: of the question).
"""

import json
import struct
from typing import Any

HEADER = struct.Struct("<BII")
LENGTH = struct.Struct("<I")
READY, OPEN, STREAMS, CALIBRATE, REQUEST, STATUS, PICTURE, ANSWER, DETECT, DETECTIONS = range(10)
MAX_BODY = 256 << 20  # a still of 50 megapixels as PNG


def message(head: dict[str, Any], payload: bytes = b"", tail: bytes = b"") -> bytes:
    """A body. tail: JSON text of further members, ready made, such as b'"overlays":{…}'."""
    text = json.dumps(head, allow_nan=False, separators=(",", ":")).encode("ascii")
    if tail:
        text = text[:-1] + b"," + tail + b"}"
    return LENGTH.pack(len(text)) + text + payload


def parts(body: bytes) -> tuple[dict[str, Any], memoryview]:
    """A body's JSON and its bytes."""
    (length,) = LENGTH.unpack_from(body)
    view = memoryview(body)[LENGTH.size:]
    return json.loads(bytes(view[:length])), view[length:]


def payload(body: bytes) -> memoryview:
    """A body's bytes alone."""
    (length,) = LENGTH.unpack_from(body)
    return memoryview(body)[LENGTH.size + length:]
