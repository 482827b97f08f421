"""A calibration without clicks: from the painted lines of one picture to the field, the camera and its proof.

seen_lines.py   the lines of a picture, straightened by a lens that makes most of them straight
hypotheses.py   cameras that four lines, three lines or four corners allow, and how well each explains the lines
refinement.py   one camera, moved onto the lines
matching.py     the cameras above one field, matched and refined
search.py       the best cameras above an area of a field, and which of several fields it is
assignment.py   which line is which, points on each, the fit of a model to them, and its proof
request.py      the whole of it for a chosen field and area
recognition.py  the same where the picture is to tell the field, the area or the rotation
"""
