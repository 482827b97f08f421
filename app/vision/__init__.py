"""Pixels to observations: what is looked for in a picture, and how exactly it is found.

    boards.py    the inner corners of a chessboard or ChArUco board
    corners.py   a corner to a few hundredths of a pixel, in a window as large as its squares allow
    edges.py     long smooth edges as chains of sub-pixel points, which a lens may have bent
    edge_joining.py   pieces of one edge put together across what interrupts it
    line_search.py   which painted line a click means
    line_snap.py     that line's middle beside the click, from both its edges
    line_patches.py   how far lines have moved across themselves since they were seen first
    light.py     what is burnt out or black, and how evenly the carpet is lit
    sharpness.py   how wide edges are in each of nine zones
    flicker.py   lamps that flicker, from a short series of frames
    zones.py     the nine zones, and what they are called
    stages/      what plays on the field, step by step: noise, colours, blobs, robots, ball, places
    sight.py     a plan of those stages, run on frame after frame
    views.py     pixels to places at a height, as stages ask for it
    colour_table.py, colour_learning.py, colour_automatic.py, colour_health.py   which colour a pixel is
    runs.py, blob_features.py, dots.py   patches of one colour, and dots around a middle
    background.py   one clean picture of many frames, in which people and robots vanish

Members take a picture (height, width) or (height, width, 3) uint8 and give arrays or frozen records; what is not there
is None or empty, never a guess. No files, no clocks: whoever watches a camera calls them.
"""
