"""What stands in the room, as numbers: everything that a scene in 3-D shows, computed from records alone.

    shapes.py     a mesh, and what is painted on the carpet, with the goals, to scale
    hung.py       where a camera hangs, which way it looks, and its picture as a pinhole there would take it
    landings.py   where the rays of clicked points land, and how far from where they should
    sheet.py      expected error over the region, as a coloured sheet
    lying.py      a picture that lies level: the sheet, or a corrected picture where a model knows of no camera
    moved.py      what has moved between two versions
    boards.py     where a board was held before a camera, and which part of the picture it covered
    standing.py   one calibration with all of this
    views.py      from where the room is looked at: above, a camera, free
    place.py      one place of the carpet: its pixel in every camera, and the expected error there

    camera = Standing.of("north", "North", calibration)
    camera.hung.height_mm, camera.landings.feet, told_at((0.0, 500.0), [camera])

Lengths are mm in the field frame (geometry.py); whoever draws them knows units of its own. A scene draws and computes
nothing.
"""
