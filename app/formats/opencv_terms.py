"""Lenses as OpenCV numbers them, which ROS, mrcal and PhotonVision follow: k1 k2 p1 p2 k3 k4 k5 k6."""

from app.formats.numbers import refuse
from app.models.lenses.brown_conrady import TERMS
from app.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS

LENSES = {"brown-conrady": TERMS}
WITH_FISHEYE = {**LENSES, "fisheye": FISHEYE_TERMS}


def shortened(terms: tuple[float, ...], counts: tuple[int, ...] = (5, 8)) -> tuple[float, ...]:
    """The fewest terms, one of `counts`, that leave out zeros alone."""
    return next(terms[:n] for n in counts if not any(terms[n:]))


def lengthened(terms: tuple[float, ...], at: str) -> tuple[float, ...]:
    """All eight; BadInput where there are terms that our lens does not know, such as OpenCV's thin prism."""
    if any(terms[len(TERMS):]):
        raise refuse(f"{at} has terms beyond k6 (thin prism or tilt), which no lens here has.",
                     "Calibrate with at most eight terms.")
    return tuple(terms[:len(TERMS)]) + (0.0,) * (len(TERMS) - len(terms[:len(TERMS)]))
