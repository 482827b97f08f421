"""The simulated camera: a rendered field seen through a real lens model, with the exact truth about it.

    lens.py       where a ray lands on the image plane, and back: Brown–Conrady, Kannala–Brandt, division
    camera.py     where the camera stands: field mm to raw pixels and back, at any height
    clicks.py     what an operator would click: along borders and on grids, exact or with noise
    reference.py  the 4 × 3 m field and camera that all method figures refer to
    paint.py      how much of each pixel a marking covers, true to a few thousandths of a pixel
    look.py       carpet, floor, lamps, vignette
    things.py     what stands up, drawn where a camera sees it: at its own height
    play.py       who is where at a time: robots, ball, goals, people
    render.py     all of it as one frame after the other
    source.py     sim://FIELD?…, the source
"""
