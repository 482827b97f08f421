"""Whether a camera still stands as it did when it was calibrated, from the field's lines; and its pose if it does not.

check.py        a calibration against a new picture: every line, the figures, a verdict
figures.py      how far lines lie off, and how far they have moved since its points were set
verdict.py      the level, a sentence and what to do
alarm.py        the status of a camera that is looked at each second
live.py         those looks, in the camera's process
tracking.py     the lines again, in a picture that has moved
reregister.py   a new pose by those lines, with the lens as it was, and whether it still is
service.py      what is claimed of a version by its lines; a new pose, saved
"""
