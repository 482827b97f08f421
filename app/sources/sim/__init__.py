"""The simulated camera: a rendered field seen through a real lens model, with the exact truth about it.

    lens.py       where a ray lands on the image plane, and back: Brown–Conrady, Kannala–Brandt, division
    camera.py     where the camera stands: field mm to raw pixels and back, at any height
    clicks.py     what an operator would click: along borders and on grids, exact or with noise
    reference.py  the 4 × 3 m field and camera that all method figures refer to
"""
