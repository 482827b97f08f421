"""A page that looks at a scene, as viser's own would: what it says first, and what it is told."""

import msgspec
import viser
import zstandard

PROTOCOL = f"viser-v{viser.__version__}"
LOOK = msgspec.msgpack.encode(
    {  # only with it is a page a viewer
        "type": "ViewerCameraMessage",
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (0.0, 0.0, 5.0),
        "fov": 1.0,
        "near": 0.01,
        "far": 1000.0,
        "image_height": 600,
        "image_width": 900,
        "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 1.0, 0.0),
    }
)


def messages_of(packet: bytes) -> str:
    """What a packet tells, as text in which names can be found: its length, then that of it packed, then it packed."""
    return zstandard.decompress(packet[16 : 16 + int.from_bytes(packet[8:16], "little")]).decode(
        "latin-1"
    )
