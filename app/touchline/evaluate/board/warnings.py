"""What a board calibration should be doubted for, each with its cure."""

from collections.abc import Iterator

import numpy as np

from touchline.core.geometry import Array
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.core.text_format import format_number, format_with_sigma
from touchline.evaluate.board.cross_validation import CrossValidation
from touchline.evaluate.board.focal_drift import FocalDrift
from touchline.fitting.board.fit import BoardFit

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


def board_warnings(fit: BoardFit, cv: CrossValidation, drift: FocalDrift, expected: Array, cover: float,
                   tilts_deg: Array, correlation: float) -> Iterator[Warning]:
    """expected: over the picture, px; cover: share of the picture's cells that have corners."""
    if drift.significant:
        yield Warning("focal-length-changed", say(
            "warning.focal-length-changed", "The focal length changes by {pct} % from the first to the second half of "
            "the views. Zoom or focus moved in between.",
            pct=format_with_sigma(100 * drift.change, 100 * drift.sigma)), say(
            "warning.focal-length-changed.fix", "Lock zoom and focus, switch autofocus off, and take all images "
                                                "again."))
    yield from _spread(fit, cv, expected, cover, tilts_deg)
    yield from _model(fit, cv, correlation)
    for out in fit.left_out:
        yield Warning("view-left-out", out.text, say(
            "warning.view-left-out.fix", "Check that the image is sharp and that the whole board was detected "
                                         "correctly."), out.name, out.index)
    strays = int(fit.outliers.sum())
    if strays:
        corners = int(fit.observations.present.sum()) + strays
        yield Warning("stray-corners", say(
            "warning.stray-corners", "{n} of {all} corners are too far from their predicted position and were "
            "excluded.", n=strays, all=corners), say(
            "warning.stray-corners.fix", "A few are normal, caused by blur, glare or a finger."))


def _spread(fit: BoardFit, cv: CrossValidation, expected: Array, cover: float, tilts_deg: Array) -> Iterator[Warning]:
    tilted, middle = float(np.mean(tilts_deg >= TILTED_DEG)), float(np.nanmedian(expected))
    if tilted < MIN_TILTED:
        yield Warning("badly-spread-views", say(
            "warning.too-few-tilted", "Only {n} of {all} views are tilted by {deg:.0f}° or more. Focal length and "
            "distance cannot be separated well.", n=int(np.sum(tilts_deg >= TILTED_DEG)), all=len(tilts_deg),
            deg=TILTED_DEG), say(
            "warning.too-few-tilted.fix", "Add views with the board tilted about 35° to each of the four sides."))
    elif middle > EXPECTED_SIGMAS * fit.sigma_px:
        yield Warning("badly-spread-views", say(
            "warning.lens-uncertain", "The lens is uncertain by {px} px across the image, {times:.0f} times the corner "
            "noise.", px=format_number(middle), times=middle / max(fit.sigma_px, 1e-9)), say(
            "warning.lens-uncertain.fix", "Add views. The report names the view that helps most."))
    if cover < MIN_COVER:
        yield Warning("picture-not-covered", say(
            "warning.picture-not-covered", "The corners cover {share:.0f}% of the image. Elsewhere the lens is "
            "extrapolated.", share=100 * cover), say(
            "warning.picture-not-covered.fix", "Add views near the edges and corners of the image."))
    if cv.halves_ratio > HALVES_SIGMAS:
        yield Warning("halves-disagree", say(
            "warning.halves-disagree", "The lenses from each half of the views differ by {px} px, {times:.0f} times "
            "the corner noise. The true error is larger than the residual.", px=format_number(2 * cv.halves_px),
            times=2 * cv.halves_ratio), say(
            "warning.halves-disagree.fix", "Add tilted views all over the image. Lock focus and zoom, and keep the "
                                           "board flat."))
    if "centre_x" in fit.lens.sigma and max(fit.lens.sigma["centre_x"], fit.lens.sigma["centre_y"]) \
            > 0.02 * fit.lens.image_size.width:
        yield Warning("centre-unknown", say(
            "warning.centre-unknown", "The views do not determine the principal point well."), say(
            "warning.centre-unknown.fix", "Tilt the board more, or fix the principal point at the image centre "
                                          "(centre: false)."))


def _model(fit: BoardFit, cv: CrossValidation, correlation: float) -> Iterator[Warning]:
    if (correlation > SHAPE and fit.sigma_px > SHAPE_SIGMA_PX) or cv.held_ratio > HELD_OUT_TIMES:
        other = "fisheye" if fit.lens.model != "fisheye" else "brown-conrady"
        yield Warning("wrong-model", say(
            "warning.wrong-model", "The residuals are not random (correlation of neighbouring corners "
            "{correlation:.2f}; cross-validated error {times:.1f} times the residual). These terms cannot describe "
            "this lens.", correlation=correlation, times=cv.held_ratio), say(
            "warning.wrong-model.fix", "Try more terms, or the model {model}.", model=other))
    if fit.sigma_px > NOISY_PX:
        yield Warning("noisy-corners", say(
            "warning.noisy-corners", "The corners are {px} px from their predicted position. In sharp images this is "
            "0.1 to 0.3 px.", px=format_number(fit.sigma_px)), say(
            "warning.noisy-corners.fix", "Hold the board still and in focus. Check its columns, rows and square size."))
    for name in fit.terms:
        value, sigma = fit.lens.values[name], fit.lens.sigma.get(name, 0.0)
        if abs(value) < UNSUPPORTED_SIGMAS * sigma:
            yield Warning("term-not-supported", say(
                "warning.term-not-supported", "{term} = {value} is not significantly different from zero.", term=name,
                value=format_with_sigma(value, sigma)), say(
                "warning.term-not-supported.fix", 'Exclude this term, or choose terms "auto".'), name)
    bow = float(np.abs(fit.state.warp_mm).max())
    if bow > MAX_SAG * fit.observations.size_mm:
        yield Warning("board-bowed", say(
            "warning.board-bowed", "The board appears to be bowed by {mm:.1f} mm.", mm=bow), say(
            "warning.board-bowed.fix", "Mount the board on a rigid plate. If it is flat, the lens model is wrong and "
                                       "the bow compensates for it."))
