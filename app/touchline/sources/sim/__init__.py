"""The simulated camera: a rendered field seen through a real lens model.

    source.py    sim://FIELD?…, the source, and its controls: exposure, gain, white balance, resolution, rate
    camera.py    exact lens models, pose and projection
    ground.py    coverage of pixels by markings; carpet, floor, vignette; lamps that flicker and drift
    actors.py    where robots, ball and people are at a time, and their shapes, part by part
    solids.py    outlines extruded upwards
    draw.py      solids as a camera sees them, drawn on the still picture and noised, fast
    render.py    frames out of all of it
    timecode.py  a time painted into the picture

The exact truth about a frame (tests/support/sim_truth.py) is drawn by the same layers.
"""
