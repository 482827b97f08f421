"""Live cameras: one process each reads, corrects and encodes; the server hands bytes on and never touches a pixel.

    source ─▶ capture ─▶ encoder ──wire──▶ process ─▶ camera ─▶ viewer ─▶ browser
              (newest)   (per channel)                (watchdog, state)   (one slot)
              inspector (light, focus)

In the camera's process: child.py (its start), child_serving.py (what it is asked), capture.py, encoder.py, picture.py,
inspector.py, drift.py, rolls.py, stills.py, seeing.py (with painter.py and league.py), ring.py. In the server:
process.py, camera.py, sighted.py, tracked.py, state.py, viewer.py, cameras.py. Both: wire.py, channel.py.
"""

from app.live.camera import LiveCamera
from app.live.cameras import LiveCameras
from app.live.stream_spec import StreamSpec
from app.live.viewer import Viewer

__all__ = ["LiveCamera", "LiveCameras", "StreamSpec", "Viewer"]
