"""What a fit is worth: residuals, distortion, cross-validation, and the report that says it in millimetres.

    residuals.py         how far each observed point lies from its line, in px and mm
    distortion.py        how far a border bows from straight, Eq. (9)
    cross_validation.py  the same residuals, of points that the fit had not seen
    report.py            all of it as one plain record, with a verdict in a sentence
    lens_*.py            how two lenses differ over the picture, and how far off one may be, px
    drift*.py            whether a camera still stands as it did, and from when on that is an alarm
    board_*.py           the same questions of a lens from a board: spread, halves, shape of what is left, next view
"""
