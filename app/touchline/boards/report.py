"""What a lens from a board is worth, as plain JSON: residuals, coverage, cross-validation, warnings, next view."""

from collections.abc import Iterator

import numpy as np

from touchline.boards.fit import BoardFit, shared_covariance
from touchline.boards.poses import EDGES, cell_counts
from touchline.boards.problem import WARP, BoardObservations
from touchline.boards.uncertainty import (
    MIN_TILT_DEG,
    CrossValidation,
    FocalDrift,
    cross_validate,
    expected_over_picture,
    next_view,
    tilts,
)
from touchline.core.geometry import Array
from touchline.core.json_values import JsonObject, finite_json
from touchline.core.records import Warning
from touchline.core.statements import format_number, format_with_sigma, say, stated

SAME_ROW = 1e-3  # of the board's half diagonal
MAX_GOOD_SIGMAS = 3.0  # of a corner: so well a lens is known from about twenty well-spread views
STEEP_DEG = 25.0  # foreshortened by a tenth
MIN_STEEP_SHARE = 1 / 3  # of the views
MIN_COVERED_SHARE = 0.5  # of the image's cells
MAX_EXPECTED_SIGMAS = 5.0  # an error over the image beyond it: the views hardly determine the lens
MAX_HALVES_SIGMAS = 10.0
MAX_CENTRE_SIGMA_SHARE = 0.02  # of the image's width
MAX_CORRELATION = 0.3  # of neighbours' residuals; noise makes less than 0.1
# below it, detectors and boards alone make correlations up to 0.6 on real images
MIN_CORRELATED_SIGMA_PX = 0.3
MAX_NOISE_PX = 1.0
MAX_HELD_OUT_RATIO = 1.5
MIN_TERM_SIGMAS = 2.0
MAX_BOW = 0.02  # of the board's half diagonal
SERIOUS = (
    "focal-length-changed",
    "wrong-model",
    "noisy-corners",
    "badly-spread-views",
    "halves-disagree",
)


def board_report(fit: BoardFit) -> JsonObject:
    """Return plain JSON; what is unknown is None."""
    lengths = np.linalg.norm(fit.residuals_px, axis=-1)
    degrees, nearer = tilts(fit)
    counts = cell_counts(fit.observations.pixels[fit.observations.present], fit.lens.image_size)
    expected = expected_over_picture(fit.lens)
    cv, drift = cross_validate(fit), FocalDrift.of(fit)
    correlation = neighbour_correlation(fit.residuals_px, fit.observations)
    covered = float((counts > 0).mean())
    warnings = [
        w.to_json() for w in _warnings(fit, cv, drift, expected, covered, degrees, correlation)
    ]
    following = next_view(fit)
    report = {
        "rms_px": fit.rms_px,
        "sigma_px": fit.sigma_px,
        "max_px": float(np.nanmax(lengths)),
        "corners": int(fit.observations.present.sum()),
        "strays": int(fit.outliers.sum()),
        "views": _views(fit, lengths, degrees, nearer),
        "terms": {"chosen": list(fit.terms), "tried": dict(fit.tried)},
        "parameters": {
            name: {"value": value, "sigma": fit.lens.sigma.get(name)}
            for name, value in fit.lens.values.items()
        },
        "bow_mm": _bow(fit),
        "coverage": {
            "cells": counts.tolist(),
            "share": covered,
            "tilts": {
                "face on": nearer.count(""),
                **{f"{edge} edge nearer": nearer.count(edge) for edge in EDGES},
            },
            "median_tilt_deg": float(np.median(degrees)),
            "face_on_below_deg": MIN_TILT_DEG,
        },
        "expected_px": {
            "median": float(np.nanmedian(expected)),
            "max": float(np.nanmax(expected)),
            "grid": expected.tolist(),
        },
        "cross_validation": cv.to_json(),
        "focal_drift": drift.to_json(),
        "neighbour_correlation": correlation,
        "next_view": following.to_json() if following else None,
        "warnings": warnings,
    }
    report["verdict"] = _verdict(report)
    return finite_json(report)


def neighbour_correlation(residuals: Array, observations: BoardObservations) -> float:
    """Return the correlation of the residuals (v, m, 2) of corners that are neighbours in a row of the board.

    About 0 for noise; towards 1 for a shape: then the model is wrong, however small the residuals are.
    """
    finite = np.isfinite(residuals).all(axis=-1)
    x, y = observations.places[..., 0], observations.places[..., 1]
    rows = np.rint(y / (SAME_ROW * observations.half_diagonal_mm))
    # Row by row, in each row from left to right; corners without a residual come last.
    order = np.lexsort((np.where(finite, x, np.inf), np.where(finite, rows, np.inf)), axis=1)
    rows, finite = (
        np.take_along_axis(rows, order, axis=1),
        np.take_along_axis(finite, order, axis=1),
    )
    residuals = np.take_along_axis(residuals, order[..., None], axis=1)
    pairs = finite[:, 1:] & finite[:, :-1] & (rows[:, 1:] == rows[:, :-1])
    if not pairs.any():
        return float("nan")
    first, second = residuals[:, :-1][pairs], residuals[:, 1:][pairs]
    power = np.sum(first**2) + np.sum(second**2)
    return float(2 * np.sum(first * second) / power) if power > 0 else 0.0


def _views(
    fit: BoardFit, lengths: Array, degrees: Array, nearer: tuple[str, ...]
) -> list[JsonObject]:
    reasons = {out.index: out for out in fit.left_out}
    quads = _quads_mm(fit)
    used_views = iter(range(len(lengths)))
    entries = []
    for index, view in enumerate(fit.views):
        entry: JsonObject = {
            "name": view.name,
            "corners": len(view.pixels),
            "used": bool(fit.used[index]),
        }
        if fit.used[index]:
            k = next(used_views)
            entry |= {
                "rms_px": float(np.sqrt(np.nanmean(lengths[k] ** 2))),
                "strays": int(fit.outliers[k].sum()),
                "tilt_deg": float(degrees[k]),
                "nearer": nearer[k],
                "distance_mm": float(np.linalg.norm(fit.state.translations_mm[k])),
                "quad_mm": quads[k].tolist(),
            }
        else:
            entry |= {"reason": reasons[index].reason, "text": reasons[index].text}
        entries.append(entry)
    return entries


def _quads_mm(fit: BoardFit) -> Array:
    """Return where the outermost corners were held, in the camera's frame, one way round: (used views, 4, 3) mm."""
    places = fit.observations.places[fit.observations.present][:, :2]
    (x0, y0), (x1, y1) = np.min(places, axis=0), np.max(places, axis=0)
    outline = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    return outline @ fit.state.rotations.transpose(0, 2, 1) + fit.state.translations_mm[:, None]


def _bow(fit: BoardFit) -> JsonObject | None:
    if not set(WARP) <= set(fit.solution.names):
        return None
    sigma = np.sqrt(np.diag(shared_covariance(fit.solution)))
    at = [fit.solution.names.index(name) for name in WARP]
    return {
        "x": float(fit.state.warp_mm[0]),
        "y": float(fit.state.warp_mm[1]),
        "sigma": [float(sigma[i]) for i in at],
    }


def _warnings(
    fit: BoardFit,
    cv: CrossValidation,
    drift: FocalDrift,
    expected: Array,
    covered: float,
    tilts_deg: Array,
    correlation: float,
) -> Iterator[Warning]:
    """Yield what the lens should be doubted for, each with its remedy.

    expected: over the image, px; covered: share of the image's cells that have corners.
    """
    if drift.significant:
        yield Warning(
            "focal-length-changed",
            say(
                "warning.focal-length-changed",
                "The focal length changes by {pct} % from the first to the second half of "
                "the views. Zoom or focus moved in between.",
                pct=format_with_sigma(100 * drift.change, 100 * drift.sigma),
            ),
            say(
                "warning.focal-length-changed.fix",
                "Lock zoom and focus, switch autofocus off, and take all images again.",
            ),
        )
    yield from _spread_warnings(fit, cv, expected, covered, tilts_deg)
    yield from _model_warnings(fit, cv, correlation)
    for out in fit.left_out:
        yield Warning(
            "view-left-out",
            out.text,
            say(
                "warning.view-left-out.fix",
                "Check that the image is sharp and that the whole board was detected correctly.",
            ),
            out.name,
            out.index,
        )
    outliers = int(fit.outliers.sum())
    if outliers:
        corners = int(fit.observations.present.sum()) + outliers
        yield Warning(
            "stray-corners",
            say(
                "warning.stray-corners",
                "{n} of {all} corners are too far from their predicted position and were excluded.",
                n=outliers,
                all=corners,
            ),
            say(
                "warning.stray-corners.fix", "A few are normal, caused by blur, glare or a finger."
            ),
        )


def _spread_warnings(
    fit: BoardFit, cv: CrossValidation, expected: Array, covered: float, tilts_deg: Array
) -> Iterator[Warning]:
    steep, median_px = tilts_deg >= STEEP_DEG, float(np.nanmedian(expected))
    if float(np.mean(steep)) < MIN_STEEP_SHARE:
        yield Warning(
            "badly-spread-views",
            say(
                "warning.too-few-tilted",
                "Only {n} of {all} views are tilted by {deg:.0f}° or more. Focal length and "
                "distance cannot be separated well.",
                n=int(np.sum(steep)),
                all=len(tilts_deg),
                deg=STEEP_DEG,
            ),
            say(
                "warning.too-few-tilted.fix",
                "Add views with the board tilted about 35° to each of the four sides.",
            ),
        )
    elif median_px > MAX_EXPECTED_SIGMAS * fit.sigma_px:
        yield Warning(
            "badly-spread-views",
            say(
                "warning.lens-uncertain",
                "The lens is uncertain by {px} px across the image, {times:.0f} times the corner "
                "noise.",
                px=format_number(median_px),
                times=median_px / max(fit.sigma_px, 1e-9),
            ),
            say(
                "warning.lens-uncertain.fix",
                "Add views. The report names the view that helps most.",
            ),
        )
    if covered < MIN_COVERED_SHARE:
        yield Warning(
            "picture-not-covered",
            say(
                "warning.picture-not-covered",
                "The corners cover {share:.0f}% of the image. Elsewhere the lens is extrapolated.",
                share=100 * covered,
            ),
            say(
                "warning.picture-not-covered.fix",
                "Add views near the edges and corners of the image.",
            ),
        )
    if cv.halves_ratio > MAX_HALVES_SIGMAS:
        yield Warning(
            "halves-disagree",
            say(
                "warning.halves-disagree",
                "The lenses from each half of the views differ by {px} px, {times:.0f} times "
                "the corner noise. The true error is larger than the residual.",
                px=format_number(2 * cv.halves_px),
                times=2 * cv.halves_ratio,
            ),
            say(
                "warning.halves-disagree.fix",
                "Add tilted views all over the image. Lock focus and zoom, and keep the "
                "board flat.",
            ),
        )
    if (
        "centre_x" in fit.lens.sigma
        and max(fit.lens.sigma["centre_x"], fit.lens.sigma["centre_y"])
        > MAX_CENTRE_SIGMA_SHARE * fit.lens.image_size.width
    ):
        yield Warning(
            "centre-unknown",
            say("warning.centre-unknown", "The views do not determine the principal point well."),
            say(
                "warning.centre-unknown.fix",
                "Tilt the board more, or fix the principal point at the image centre "
                "(centre: false).",
            ),
        )


def _model_warnings(fit: BoardFit, cv: CrossValidation, correlation: float) -> Iterator[Warning]:
    has_shape = correlation > MAX_CORRELATION and fit.sigma_px > MIN_CORRELATED_SIGMA_PX
    if has_shape or cv.held_out_ratio > MAX_HELD_OUT_RATIO:
        other = "fisheye" if fit.lens.model != "fisheye" else "brown-conrady"
        yield Warning(
            "wrong-model",
            say(
                "warning.wrong-model",
                "The residuals are not random (correlation of neighbouring corners "
                "{correlation:.2f}; cross-validated error {times:.1f} times the residual). These terms cannot describe "
                "this lens.",
                correlation=correlation,
                times=cv.held_out_ratio,
            ),
            say("warning.wrong-model.fix", "Try more terms, or the model {model}.", model=other),
        )
    if fit.sigma_px > MAX_NOISE_PX:
        yield Warning(
            "noisy-corners",
            say(
                "warning.noisy-corners",
                "The corners are {px} px from their predicted position. In sharp images this is "
                "0.1 to 0.3 px.",
                px=format_number(fit.sigma_px),
            ),
            say(
                "warning.noisy-corners.fix",
                "Hold the board still and in focus. Check its columns, rows and square size.",
            ),
        )
    for name in fit.terms:
        value, sigma = fit.lens.values[name], fit.lens.sigma.get(name, 0.0)
        if abs(value) < MIN_TERM_SIGMAS * sigma:
            yield Warning(
                "term-not-supported",
                say(
                    "warning.term-not-supported",
                    "{term} = {value} is not significantly different from zero.",
                    term=name,
                    value=format_with_sigma(value, sigma),
                ),
                say("warning.term-not-supported.fix", 'Exclude this term, or choose terms "auto".'),
                name,
            )
    bow = float(np.abs(fit.state.warp_mm).max())
    if bow > MAX_BOW * fit.observations.half_diagonal_mm:
        yield Warning(
            "board-bowed",
            say("warning.board-bowed", "The board appears to be bowed by {mm:mm} mm.", mm=bow),
            say(
                "warning.board-bowed.fix",
                "Mount the board on a rigid plate. If it is flat, the lens model is wrong and "
                "the bow compensates for it.",
            ),
        )


def _verdict(report: JsonObject) -> JsonObject:
    """Return the level: good; fair, with small doubts; poor, not to be trusted over the whole image."""
    reasons = {w["reason"] for w in report["warnings"]}
    halves, sigma = report["cross_validation"]["halves_px"], report["sigma_px"]
    # noise alone, or what the halves showed
    error = float(np.nanmax([report["expected_px"]["median"], halves]))
    serious = [reason for reason in SERIOUS if reason in reasons]
    if serious:
        text = next(w["text"] for w in report["warnings"] if w["reason"] == serious[0])
        return stated({"level": "poor", "sentence": text})
    level = (
        "fair"
        if "picture-not-covered" in reasons or not error <= MAX_GOOD_SIGMAS * sigma
        else "good"
    )
    return stated(
        {
            "level": level,
            "sentence": say(
                "board.uncertainty",
                "Lens model uncertainty: about {px} px across the image (corner detection: {corner_px} "
                "px).",
                px=format_number(error),
                corner_px=format_number(sigma),
            ),
        }
    )
