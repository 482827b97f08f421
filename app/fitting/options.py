"""The options that fitters share, and those of all cameras with rays."""

from app.core.options import Option
from app.fitting.corrected_rectangle import RECTANGLE_OPTIONS

LINE_SIGMA = Option("line_sigma_mm", "float", None, "How far the painted lines may be from their places. Empty: as the "
                    "picture shows, about what the field says; 0 takes them as exact.", (0, 200), "mm")
CLICK_SIGMA = Option("click_sigma_px", "float", None, "How well points are clicked. Empty: estimated from the clicks.",
                     (0.01, 20), "px")
COMMON_OPTIONS: tuple[Option, ...] = (
    *RECTANGLE_OPTIONS,
    Option("robust", "bool", True, "Name stray clicks and leave them out of the fit."),
)

RAY_OPTIONS: tuple[Option, ...] = (
    Option("height_mm", "value-and-sigma", None, "The camera's height above the carpet by tape, and how sure it is. "
           "It tells focal length and height apart.", (100, 50_000), "mm"),
    Option("lens", "calibration", None, "A calibration or board whose lens is taken; the field fixes the pose."),
    Option("lens_sigma", "choice", None, "0 holds that lens fast; own holds it as well as it was known.",
           choices=("0", "own")),
    LINE_SIGMA,
    CLICK_SIGMA,
    Option("centre_sigma_px", "float", None, "How far the principal point may be from the picture's middle. Empty: "
           "1.2 % of the width; 0 holds it there.", (0, 500), "px"),
    Option("aspect_sigma", "float", None, "How far the pixels' aspect may be from square. Empty: 0.002, or 0 for SSL; "
           "0 holds it.", (0, 0.2), ""),
    *COMMON_OPTIONS,
)

TERMS_OPTION = Option("terms", "terms-or-auto", "auto", "Which terms to estimate; auto takes what the points support.")
