"""The options that all models with rays share."""

from app.models import Option

RAY_OPTIONS: tuple[Option, ...] = (
    Option("height_mm", "value-and-sigma", None, "The camera's height above the carpet by tape, and how sure it is. "
           "It tells focal length and height apart.", (100, 50_000), "mm"),
    Option("lens", "calibration", None, "A calibration or board whose lens is taken; the field fixes the pose."),
    Option("lens_sigma", "choice", None, "0 holds that lens fast; own holds it as well as it was known.",
           choices=("0", "own")),
    Option("line_sigma_mm", "float", 0.0, "How far the painted lines may be from their places; 0 takes them as exact.",
           (0, 200), "mm"),
    Option("click_sigma_px", "float", None, "How well points are clicked. Empty: estimated from the clicks.",
           (0.01, 20), "px"),
    Option("centre_sigma_px", "float", 0.0, "How far the lens's centre may be from the picture's; 0 holds it there.",
           (0, 500), "px"),
    Option("w_max_rectangle_px", "float", None, "Width of the widest calibration rectangle; the same for all cameras "
           "of a rig. Empty: from the field and the picture.", (1, 10_000), "px"),
    Option("h_max_rectangle_px", "float", None, "Height of the highest calibration rectangle.", (1, 10_000), "px"),
    Option("n_rectangles_x", "int", None, "Rectangles between the left and the right border.", (1, 1000)),
    Option("n_rectangles_y", "int", None, "Rectangles between the top and the bottom border.", (1, 1000)),
    Option("robust", "bool", True, "Name stray clicks and leave them out of the fit."),
)
