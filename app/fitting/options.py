"""The options that fitters share."""

from app.core.options import Option
from app.fitting.corrected_rectangle import RECTANGLE_OPTIONS

LINE_SIGMA = Option("line_sigma_mm", "float", 0.0, "How far the painted lines may be from their places; 0 takes them "
                    "as exact.", (0, 200), "mm")
CLICK_SIGMA = Option("click_sigma_px", "float", None, "How well points are clicked. Empty: estimated from the clicks.",
                     (0.01, 20), "px")
COMMON_OPTIONS: tuple[Option, ...] = (
    *RECTANGLE_OPTIONS,
    Option("robust", "bool", True, "Name stray clicks and leave them out of the fit."),
)
