"""The geometry of the 3-D scene: everything that it shows, as numbers computed from records alone.

    shapes.py         meshes of the carpet, its markings and the goals, to scale; a level rectangle with a picture
    frustum.py        a camera's pose and field of view, and its undistorted picture
    arrows.py         where the rays of clicked points meet the carpet, their residuals, and the change of a pose
    error_surface.py  expected error over the region, as a coloured surface
    boards.py         board poses before a camera, and the part of the picture that they covered
    scene_camera.py   one calibration with all of this
    views.py          viewpoints: above, through a camera, free
    picking.py        a place on the carpet: its pixel in every camera, and the expected error there

    camera = SceneCamera.of("north", "North", calibration)
    camera.frustum.height_mm, camera.ray_hits.points, describe_place((0.0, 500.0), [camera])

Lengths are mm in the field frame; whoever draws converts them.
"""
