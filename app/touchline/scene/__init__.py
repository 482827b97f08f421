"""The 3-D scene: viser draws what is computed here from records alone, in a process of its own for each scene.

    service.py       every open scene: started on request, ended with its last viewer; what it shows; viser's own page
    routes.py        the page's socket, the scene as a file, and the way to viser under our own port and login
    messages.py      between the server and a scene's process
    live.py          that process: viser on this machine alone, what one scene shows, how it is viewed
    drawing.py       the nodes of viser: field, cameras, arrows, detections, boards, expected error
    scene_camera.py  one calibration with all that a scene shows of it; a clicked place in every camera
    frustum.py       a camera's pose and field of view, boards before a lens, viewpoints
    shapes.py        meshes of the field to scale, level pictures, the surface of expected error

Lengths are mm in the field frame.
"""
