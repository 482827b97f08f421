"""Pixels to observations: what is looked for in a picture, and how exactly it is found.

    boards.py    the inner corners of a chessboard or ChArUco board
    corners.py   a corner to a few hundredths of a pixel, in a window as large as its squares allow
    edges.py     long smooth edges as chains of sub-pixel points, which a lens may have bent
    edge_joining.py   pieces of one edge put together across what interrupts it

Members take a picture (height, width) or (height, width, 3) uint8 and give arrays or frozen records; what is not there
is None or empty, never a guess. No files, no clocks: whoever watches a camera calls them.
"""
