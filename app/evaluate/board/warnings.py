"""What a board calibration should be doubted for, each with its cure."""

from collections.abc import Iterator

import numpy as np

from app.core.geometry import Array
from app.core.records import Warning
from app.core.text_format import format_number, format_with_sigma
from app.evaluate.board.cross_validation import CrossValidation
from app.fitting.board.fit import BoardFit

TILTED_DEG = 25.0  # foreshortened by a tenth
MIN_TILTED = 1 / 3  # of the views
MIN_COVER = 0.5  # of the picture's cells
EXPECTED_SIGMAS = 5.0  # an error over the picture beyond it: the views hardly determine the lens
HALVES_SIGMAS = 10.0
SHAPE = 0.3  # correlation of neighbours' residuals; noise makes less than 0.1
SHAPE_SIGMA_PX = 0.3  # below it, finders and boards alone make correlations up to 0.6 on real pictures
NOISY_PX = 1.0
HELD_OUT_TIMES = 1.5
UNSUPPORTED_SIGMAS = 2.0
MAX_SAG = 0.02  # of the board's half diagonal


def board_warnings(fit: BoardFit, cv: CrossValidation, expected: Array, cover: float, tilts_deg: Array,
                   correlation: float) -> Iterator[Warning]:
    """expected: over the picture, px; cover: share of the picture's cells that have corners."""
    yield from _spread(fit, cv, expected, cover, tilts_deg)
    yield from _model(fit, cv, correlation)
    for out in fit.left_out:
        yield Warning("view-left-out", out.text,
                      "Check that the image is sharp and that the whole board was detected correctly.",
                      out.name, out.index)
    strays = int(fit.outliers.sum())
    if strays:
        corners = int(fit.observations.present.sum()) + strays
        yield Warning("stray-corners",
                      f"{strays} of {corners} corners are too far from their predicted position and were excluded.",
                      "A few are normal, caused by blur, glare or a finger.")


def _spread(fit: BoardFit, cv: CrossValidation, expected: Array, cover: float, tilts_deg: Array) -> Iterator[Warning]:
    cure = "Add views. The report names the view that helps most."
    tilted, middle = float(np.mean(tilts_deg >= TILTED_DEG)), float(np.nanmedian(expected))
    if tilted < MIN_TILTED:
        yield Warning("badly-spread-views",
                      f"Only {np.sum(tilts_deg >= TILTED_DEG)} of {len(tilts_deg)} views are tilted by "
                      f"{TILTED_DEG:.0f}° or more. Focal length and distance cannot be separated well.",
                      "Add views with the board tilted about 35° to each of the four sides.")
    elif middle > EXPECTED_SIGMAS * fit.sigma_px:
        yield Warning("badly-spread-views",
                      f"The lens is uncertain by {format_number(middle)} px across the image, "
                      f"{middle / max(fit.sigma_px, 1e-9):.0f} times the corner noise.",
                      cure)
    if cover < MIN_COVER:
        yield Warning("picture-not-covered", f"The corners cover {cover:.0%} of the image. Elsewhere the lens is "
                                             "extrapolated.",
                      "Add views near the edges and corners of the image.")
    if cv.halves_ratio > HALVES_SIGMAS:
        yield Warning("halves-disagree",
                      f"The lenses from each half of the views differ by {format_number(2 * cv.halves_px)} px, "
                      f"{2 * cv.halves_ratio:.0f} times the corner noise. The true error is larger than the residual.",
                      "Add tilted views all over the image. Lock focus and zoom, and keep the board flat.")
    if "centre_x" in fit.lens.sigma and max(fit.lens.sigma["centre_x"], fit.lens.sigma["centre_y"]) \
            > 0.02 * fit.lens.image_size.width:
        yield Warning("centre-unknown",
                      "The views do not determine the principal point well.",
                      "Tilt the board more, or fix the principal point at the image centre (centre: false).")


def _model(fit: BoardFit, cv: CrossValidation, correlation: float) -> Iterator[Warning]:
    if (correlation > SHAPE and fit.sigma_px > SHAPE_SIGMA_PX) or cv.held_ratio > HELD_OUT_TIMES:
        other = "fisheye" if fit.lens.model != "fisheye" else "brown-conrady"
        yield Warning("wrong-model",
                      f"The residuals are not random (correlation of neighbouring corners {correlation:.2f}; "
                      f"cross-validated error {cv.held_ratio:.1f} times the residual). These terms cannot describe "
                      "this lens.",
                      f"Try more terms, or the model {other}.")
    if fit.sigma_px > NOISY_PX:
        yield Warning("noisy-corners",
                      f"The corners are {format_number(fit.sigma_px)} px from their predicted position. In sharp "
                      "images this is 0.1 to 0.3 px.",
                      "Hold the board still and in focus. Check its columns, rows and square size.")
    for name in fit.terms:
        value, sigma = fit.lens.values[name], fit.lens.sigma.get(name, 0.0)
        if abs(value) < UNSUPPORTED_SIGMAS * sigma:
            yield Warning("term-not-supported",
                          f"{name} = {format_with_sigma(value, sigma)} is not significantly different from zero.",
                          'Exclude this term, or choose terms "auto".', name)
    bow = float(np.abs(fit.state.warp_mm).max())
    if bow > MAX_SAG * fit.observations.size_mm:
        yield Warning("board-bowed", f"The board appears to be bowed by {bow:.1f} mm.",
                      "Mount the board on a rigid plate. If it is flat, the lens model is wrong and the bow "
                      "compensates for it.")
