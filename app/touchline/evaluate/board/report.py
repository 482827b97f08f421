"""What a lens from a board is worth, as one plain record: residuals, coverage, cross-validation, doubts, next view."""

from typing import Any

import numpy as np

from touchline.core.geometry import Array
from touchline.core.json_values import finite_json
from touchline.core.statements import say, stated
from touchline.core.text_format import format_number
from touchline.evaluate.board.coverage import FACE_ON_DEG, LEANS, cell_counts, next_view, tilts
from touchline.evaluate.board.cross_validation import cross_validate
from touchline.evaluate.board.focal_drift import FocalDrift
from touchline.evaluate.board.lens_uncertainty import expected_over_picture
from touchline.evaluate.board.warnings import board_warnings
from touchline.fitting.board.fit import BoardFit, shared_covariance
from touchline.fitting.board.parameters import WARP, BoardObservations

SAME_ROW = 1e-3  # of the board's size


def board_report(fit: BoardFit) -> dict[str, Any]:
    """Plain JSON; what is unknown is None."""
    lengths = np.linalg.norm(fit.residuals_px, axis=-1)
    degrees, leans = tilts(fit)
    counts = cell_counts(fit.observations.pixels[fit.observations.present], fit.lens.image_size)
    expected = expected_over_picture(fit.lens)
    cv, drift = cross_validate(fit), FocalDrift.of(fit)
    correlation = neighbour_correlation(fit.residuals_px, fit.observations)
    cover = float((counts > 0).mean())
    warnings = [w.to_json() for w in board_warnings(fit, cv, drift, expected, cover, degrees, correlation)]
    following = next_view(fit)
    report = {
        "rms_px": fit.rms_px, "sigma_px": fit.sigma_px, "max_px": float(np.nanmax(lengths)),
        "corners": int(fit.observations.present.sum()), "strays": int(fit.outliers.sum()),
        "views": _views(fit, lengths, degrees, leans),
        "terms": {"chosen": list(fit.terms), "tried": dict(fit.tried)},
        "parameters": {name: {"value": value, "sigma": fit.lens.sigma.get(name)}
                       for name, value in fit.lens.values.items()},
        "bow_mm": _bow(fit),
        "coverage": {"cells": counts.tolist(), "share": cover,
                     "tilts": {"face on": leans.count(""), **{f"{edge} edge nearer": leans.count(edge)
                                                             for edge in LEANS}},
                     "median_tilt_deg": float(np.median(degrees)), "face_on_below_deg": FACE_ON_DEG},
        "expected_px": {"median": float(np.nanmedian(expected)), "max": float(np.nanmax(expected)),
                        "grid": expected.tolist()},
        "cross_validation": cv.to_json(), "focal_drift": drift.to_json(), "neighbour_correlation": correlation,
        "next_view": following.to_json() if following else None,
        "warnings": warnings,
    }
    report["verdict"] = _verdict(report)
    return finite_json(report)


def neighbour_correlation(residuals: Array, sights: BoardObservations) -> float:
    """Correlation of the residuals (v, m, 2) of corners that are neighbours in a row: about 0 for noise, towards 1 for
    a shape: then the model is wrong, however small the residuals are."""
    fine = np.isfinite(residuals).all(axis=-1)
    x, y = sights.places[..., 0], sights.places[..., 1]
    step = SAME_ROW * sights.size_mm
    order = np.lexsort((np.where(fine, x, np.inf), np.where(fine, np.rint(y / step), np.inf)), axis=1)
    r, row, known = (np.take_along_axis(a, order if a.ndim == 2 else order[..., None], axis=1)
                     for a in (residuals, np.rint(y / step), fine))
    pairs = known[:, 1:] & known[:, :-1] & (row[:, 1:] == row[:, :-1])
    if not pairs.any():
        return float("nan")
    first, second = r[:, :-1][pairs], r[:, 1:][pairs]
    power = np.sum(first**2) + np.sum(second**2)
    return float(2 * np.sum(first * second) / power) if power > 0 else 0.0


def _views(fit: BoardFit, lengths: np.ndarray, degrees: np.ndarray, leans: tuple[str, ...]) -> list[dict[str, Any]]:
    reasons = {out.index: out for out in fit.left_out}
    # (used views, 4, 3) mm in the camera's frame: where the board's outermost corners were held, one way round
    (x0, y0), (x1, y1) = (f(fit.observations.places[fit.observations.present][:, :2], axis=0) for f in (np.min, np.max))
    outline = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    quads = outline @ fit.state.rotations.transpose(0, 2, 1) + fit.state.shifts_mm[:, None]
    places = iter(range(len(lengths)))
    entries = []
    for index, view in enumerate(fit.views):
        entry: dict[str, Any] = {"name": view.name, "corners": len(view.pixels), "used": bool(fit.used[index])}
        if fit.used[index]:
            k = next(places)
            entry |= {"rms_px": float(np.sqrt(np.nanmean(lengths[k] ** 2))), "strays": int(fit.outliers[k].sum()),
                      "tilt_deg": float(degrees[k]), "nearer": leans[k],
                      "distance_mm": float(np.linalg.norm(fit.state.shifts_mm[k])), "quad_mm": quads[k].tolist()}
        else:
            entry |= {"reason": reasons[index].reason, "text": reasons[index].text}
        entries.append(entry)
    return entries


def _bow(fit: BoardFit) -> dict[str, Any] | None:
    if not set(WARP) <= set(fit.solution.names):
        return None
    sigma = np.sqrt(np.diag(shared_covariance(fit.solution)))
    at = [fit.solution.names.index(name) for name in WARP]
    return {"x": float(fit.state.warp_mm[0]), "y": float(fit.state.warp_mm[1]), "sigma": [float(sigma[i]) for i in at]}


DOUBTS = ("focal-length-changed", "wrong-model", "noisy-corners", "badly-spread-views", "halves-disagree")
GOOD_SIGMAS = 3.0  # of a corner: so well a lens is known from about twenty well-spread views


def _verdict(report: dict[str, Any]) -> dict[str, Any]:
    """good: nothing to doubt; fair: small doubts; poor: the lens is not to be trusted over the whole picture."""
    reasons = {w["reason"] for w in report["warnings"]}
    halves, sigma = report["cross_validation"]["halves_px"], report["sigma_px"]
    known = float(np.nanmax([report["expected_px"]["median"], halves]))  # noise alone, or what the halves showed
    doubts = [r for r in DOUBTS if r in reasons]
    if doubts:
        text = next(w["text"] for w in report["warnings"] if w["reason"] == doubts[0])
        return stated({"level": "poor", "sentence": text})
    level = "fair" if "picture-not-covered" in reasons or not known <= GOOD_SIGMAS * sigma else "good"
    return stated({"level": level, "sentence": say(
        "board.uncertainty", "Lens model uncertainty: about {px} px across the image (corner detection: {corner_px} "
        "px).", px=format_number(known), corner_px=format_number(sigma))})
