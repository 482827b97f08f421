"""Live cameras: one process each reads, corrects and encodes; the server hands bytes on and never touches a pixel.

    source ─▶ capture ─▶ encoder ──messages──▶ supervisor ─▶ camera ─▶ streams ─▶ viewer ─▶ browser
              (newest)   (per stream)          (watchdog)    (state)              (one slot)

In the camera's process: worker_main.py (its start, and what it is asked), capture.py, encoder.py, picture.py,
quality_monitor.py, snapshot.py, and the parts of capabilities (camera_part.py): drift.py, rolls.py,
detector.py (with stage_renderer.py, ssl_detection.py and frame_buffer.py). In the server: supervisor.py, camera.py,
streams.py, detection_feed.py, track_fusion.py, state.py, cameras.py. Both: messages.py, stream_spec.py.
Nothing is imported here: a camera's process would get the server's half, too.
"""
