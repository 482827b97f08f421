"""The demo's cameras as the tests of the page see them: at half their size and few frames a second.

Their pictures are drawn while somebody looks; at full size that would take most of a small machine.
"""

from touchline.cli.server import DEMO_CAMERAS

FPS = 5
WIDTH, HEIGHT = 640, 512
CAMERAS = tuple(
    {**camera, "source": camera["source"].replace("fps=10", f"size={WIDTH}x{HEIGHT}&fps={FPS}")}
    for camera in DEMO_CAMERAS
)
