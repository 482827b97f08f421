"""Draw a lens calibration: the camera, each board pose as an outline, and the coverage of its picture."""

import numpy as np
import viser

from app.scene import METRES, NO_SHADOWS
from app.scene.cameras import viser_scale
from app.scene.geometry.boards import BoardViews

CAMERA, BOARD, EDGE = (255, 160, 40), (70, 160, 255), (20, 60, 120)
EDGE_MM = 3.0
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def draw_boards(scene: viser.SceneApi, boards: BoardViews) -> None:
    """Draw under /boards; the world is the camera's frame."""
    scene.add_camera_frustum("/boards/camera", fov=boards.fov_rad, aspect=boards.aspect, color=CAMERA,
                             scale=viser_scale(boards, boards.depth_mm), image=boards.coverage(), format="png",
                             thickness=2 * EDGE_MM * METRES, **NO_SHADOWS)
    vertices = (boards.quads * METRES).reshape(-1, 3).astype(np.float32)
    first = 4 * np.arange(len(boards.quads))[:, None, None]
    scene.add_mesh_simple("/boards/views", vertices, (FACES + first).reshape(-1, 3), color=BOARD, opacity=0.35,
                          side="double", **NO_SHADOWS)
    edges = np.stack([boards.quads, np.roll(boards.quads, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    scene.add_line_segments("/boards/edges", (edges * METRES).astype(np.float32), colors=EDGE,
                            thickness=EDGE_MM * METRES)
    for number, quad in enumerate(boards.quads):
        scene.add_label(f"/boards/name-{number}", boards.names[number] or str(number + 1),
                        position=quad[0] * METRES, font_screen_scale=0.7)
