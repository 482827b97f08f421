"""The options that fitters share, and those of all cameras with rays."""

from touchline.core.options import Option
from touchline.fitting.corrected_rectangle import RECTANGLE_OPTIONS

LINE_SIGMA = Option("line_sigma_mm", "float", None,
                    "How far the painted lines may be from their nominal position. Empty: estimated from the image, "
                    "starting from the field's own value; 0 treats them as exact.",
                    (0, 200), "mm")
CLICK_SIGMAS_PX = (0.01, 20)
CLICK_SIGMA = Option("click_sigma_px", "float", None, "How accurate the points are. Empty: estimated from the points.",
                     CLICK_SIGMAS_PX, "px")
COMMON_OPTIONS: tuple[Option, ...] = (
    *RECTANGLE_OPTIONS,
    Option("robust", "bool", True, "List outliers and exclude them from the fit."),
)

RAY_OPTIONS: tuple[Option, ...] = (
    Option("height_mm", "value-and-sigma", None,
           "The measured camera height above the carpet, and its uncertainty. It separates focal length and height.",
           (100, 50_000), "mm"),
    Option("lens", "calibration", None,
           "A calibration or board calibration whose lens is used; the field determines the pose."),
    Option("lens_sigma", "choice", None, "0 fixes that lens; own allows its own uncertainty.",
           choices=("0", "own")),
    LINE_SIGMA,
    CLICK_SIGMA,
    Option("centre_sigma_px", "float", None,
           "How far the principal point may be from the image centre. Empty: 1.2 % of the width; 0 fixes it there.",
           (0, 500), "px"),
    Option("aspect_sigma", "float", None,
           "How far the pixel aspect ratio may be from 1. Empty: 0.002, or 0 for SSL; 0 fixes it.", (0, 0.2), ""),
    *COMMON_OPTIONS,
)

TERMS_OPTION = Option("terms", "terms-or-auto", "auto",
                      "Which terms to estimate; auto uses the terms that the points support.")
