"""The simulated camera: a rendered field seen through a real lens model, with the exact truth about it.

    lens.py       where a ray lands on the image plane, and back: Brown–Conrady, Kannala–Brandt, division, SSL
    lens_choice.py  the lens that an address asks for, by preset and by terms
    camera.py     where the camera stands: field mm to raw pixels and back, at any height
    clicks.py     what an operator would click: along borders and on grids, exact or with noise
    reference.py  the 4 × 3 m field and camera that all method figures refer to
    paint.py      how much of each pixel a marking covers, true to a few thousandths of a pixel
    look.py       carpet, floor, lamps, vignette
    lamps.py      light that changes over time: flicker, rolling shutter, drift
    play.py       who is where at a time: robots, ball, people
    bodies.py     what they look like, part by part
    things.py     outlines swept upwards: what those parts are
    draw.py       things drawn where a camera sees them: at their own height
    canvas.py     the still picture, drawn on and made into frames, fast
    render.py     all of it as one frame after the other
    truth.py      what is true of a frame: places, and what hides what
    timecode.py   a time painted into the picture, and read from it
    controls.py   what can be set on the camera: exposure, gain, white balance, resolution, frame rate
    source.py     sim://FIELD?…, the source
"""
