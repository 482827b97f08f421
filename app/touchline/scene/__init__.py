"""The 3-D scene: viser draws what touchline/scene/geometry has computed, in a process of its own, and computes nothing.

    scene_registry.py  every open scene: started on request, ended with its last viewer; the process of each
    worker_main.py     that process, which answers the server
    messages.py        the messages between them
    secured_viser.py   viser on this machine alone, with a key, without tunnels to elsewhere
    scene_view.py      everything that one scene shows, and how it is viewed
    cameras.py         cameras, their pictures and footprints
    drawing.py         the field, rays, residuals, expected error, detected balls and robots, board poses
    export.py          the scene as one HTML file that needs no server

viser counts in metres and we in millimetres; METRES stands where one becomes the other.
"""

from typing import TypedDict

METRES = 1e-3


class Shadows(TypedDict):
    cast_shadow: bool
    receive_shadow: bool


NO_SHADOWS = Shadows(cast_shadow=False, receive_shadow=False)
