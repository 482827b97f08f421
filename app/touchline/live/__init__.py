"""Live cameras: one process each reads, corrects and encodes; the server hands bytes on and never touches a pixel.

    source ─▶ capture ─▶ encoder ──messages──▶ supervisor ─▶ camera ─▶ streams ─▶ viewer ─▶ browser
              (newest)   (per stream)          (watchdog)    (state)              (one slot)

In the camera's process: worker_main.py (its start, and what it is asked), capture.py, picture.py and the parts of
capabilities (camera_part.py). In the server: supervisor.py, camera.py, streams.py, and what capabilities have of a
camera there (camera_feed.py). Both: messages.py, failures.py. Nothing is imported here: a camera's process would get
the server's half, too.
"""
