"""Pixels to observations: what is looked for in a picture, and how exactly it is found.

    lines/    painted lines and long edges at sub-pixel: chains, ridges, snapping a click, movement since a reference
    quality/  light, sharpness and flicker, over nine zones
    motion/   background, moving blobs, their tracks, and straight runs

Members take a picture (height, width) or (height, width, 3) uint8 and give arrays or frozen records; what is not there
is None or empty, never a guess. No files, no clocks.
"""
