"""Fields and their editor: known ones and own ones, read from the lines of an image, or measured.

proposal.py       a field that nobody has described, from one picture and one length
tidying.py        what was read from a picture made as fields are: symmetric, joined, named
seen_markings.py  what a calibrated picture shows beside what a field has
measuring.py      a field adjusted to tape distances, or to what a calibration has found
"""
