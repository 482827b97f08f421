"""Where the field's lines are in a picture now, and how far that is from where a camera's model has them.

expected.py      places on the lines: by the model, or by the points that a calibration was made from
measurement.py   how far the line beside each place lies, px and mm; lines are looked for further and further off
motion.py        how far the whole picture has moved since lines were seen: cheap enough for every second
orientation.py   whether the picture is turned or mirrored, which the lines do not tell
"""
