"""The simulated camera: a rendered field seen through a real lens model.

    source.py       sim://FIELD?…, the source         controls.py      exposure, gain, white balance, resolution, rate
    camera.py       pose and projection               lens.py          exact lens models
    paint.py        coverage of pixels by markings    illumination.py  carpet, floor, light falloff, vignette
    lamps.py        flicker, rolling shutter, drift   motion.py        where robots, ball and people are at a time
    robot_shapes.py their shapes, part by part        solids.py        outlines extruded upwards
    draw.py         solids as a camera sees them      canvas.py        the still picture, drawn on and noised, fast
    render.py       frames out of all of it           timecode.py      a time painted into the picture

The exact truth about a frame (tests/support/sim_truth.py) is drawn by the same layers.
"""
