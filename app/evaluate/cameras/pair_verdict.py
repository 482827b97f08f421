"""Verdicts on the figures of a pair: a level, a sentence, and what to do."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.core.geometry import Array
from app.core.text_format import format_mm
from app.evaluate.cameras.own_accuracy import OwnAccuracy, capped_level
from app.evaluate.cameras.pair_agreement import PointAgreement
from app.evaluate.fit.verdict import FAIR_MM, GOOD_MM

GOOD_PX, FAIR_PX = 1.0, 3.0  # a careful click is good to half a pixel, and two of them meet
SPREAD_SHARE = 0.5  # of a shift: with less beside it, the shift is the matter
STANDS_OUT = 3.0  # times the median: one place is the matter
FEW_PLACES = 4
FEW_MATCHES = 20  # seven numbers are fitted; fewer matches hardly test them
SURE_SIGMAS = 3.0
TURNED_DEG = 0.1  # less moves nothing by a pixel


def of_agreement(found: PointAgreement, covered: float, against: Sequence[OwnAccuracy] = ()) -> dict[str, Any]:
    """{"level", "sentence", "fix"}. covered: the share of the common part that lies near a measured place.

    against: what the calibrations' own reports say against them.
    """
    agreed = _agreement_alone(found, covered)
    level = capped_level(agreed["level"], [own.level for own in against])
    if level == agreed["level"]:
        return agreed
    worst = [own for own in against if own.level == level]
    return {"level": level, "sentence": " ".join([*(own.text for own in worst), agreed["sentence"]]),
            "fix": " ".join(filter(None, [*(own.fix for own in worst), agreed["fix"]]))}


def _agreement_alone(found: PointAgreement, covered: float) -> dict[str, Any]:
    apart = found.apart_mm
    median, worst = float(np.median(apart)), float(apart.max())
    usual = apart[apart <= max(STANDS_OUT * median, FAIR_MM)]  # a mistaken match says nothing about the cameras
    size = float(np.sqrt(np.mean(usual**2)))
    level = "good" if size <= GOOD_MM else "fair" if size <= FAIR_MM else "poor"
    words = {"good": "The two cameras agree.",
             "fair": "The two cameras agree roughly. A robot shifts slightly when it passes from one to the other.",
             "poor": "The two cameras do not agree."}[level]
    sentence = f"{words} Median difference {format_mm(median)}, largest {format_mm(worst)}."
    if few := len(apart) - len(usual):
        x, y = found.places[int(np.argmax(apart))]
        return {"level": "fair" if level == "good" else level,
                "sentence": f"{sentence} {few} of {len(apart)} {'is an outlier' if few == 1 else 'are outliers'}.",
                "fix": f"Check the largest difference, at ({x:.0f}, {y:.0f}) mm: is it the same point in both images, "
                       "and is its height correct? If so, add points near it and calibrate again."}
    if level == "good":
        fix = ("Add matches all over the shared area. These cover only a small part of it."
               if len(apart) < FEW_PLACES or covered < 0.25 else "")
        return {"level": level, "sentence": sentence, "fix": fix}
    return {"level": level, "sentence": sentence, "fix": _cure(found)}


def _cure(found: PointAgreement) -> str:
    shift = np.median(found.offset_mm, axis=0)
    spread = float(np.sqrt(np.mean(np.sum((found.offset_mm - shift) ** 2, axis=1))))
    if len(found.places) < FEW_PLACES:
        return "Check these matches and their heights. Then add matches all over the shared area."
    if spread <= SPREAD_SHARE * float(np.hypot(*shift)):
        return (f"The difference is mainly a shift of ({shift[0]:.0f}, {shift[1]:.0f}) mm: one camera was moved after "
                "its calibration, or the given heights are too low. Calibrate the camera whose lines no longer fit "
                "again.")
    return ("Check the heights of the matched points. If they are correct, enter the height of both cameras, add "
            "points on lines inside the shared area, and compare the lens models.")


def of_fundamental(epipolar_px: Array, good: Array, which: Array) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of a geometry that was found from matches; all (n,), which: as they are counted."""
    rms, wrong = float(np.sqrt(np.mean(epipolar_px[good] ** 2))), which[~good]
    level = "poor" if rms > FAIR_PX else "fair" if rms > GOOD_PX or len(wrong) else "good"
    agreed = f"{int(good.sum())} of {len(good)} matches agree with one geometry, within {rms:.2f} px."
    if len(wrong):
        return {"level": level, "sentence": f"{agreed} {_named(wrong)} not.",
                "fix": "Check whether they show the same point in both images. Move or remove them."}
    few = int(good.sum()) < FEW_MATCHES
    return {"level": level, "sentence": agreed,
            "fix": "Add matches. These are too few to test the geometry that was fitted to them." if few else ""}


def _named(wrong: Array) -> str:
    numbers = [str(i + 1) for i in wrong[:6]]
    if len(wrong) == 1:
        return f"Match {numbers[0]} does"
    more = f" and {len(wrong) - 6} more" if len(wrong) > 6 else ""
    listed = ", ".join(numbers) if more else f"{', '.join(numbers[:-1])} and {numbers[-1]}"
    return f"Matches {listed}{more} do"


def of_calibrated(epipolar_px: Array, which: Array) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of matches beside the lines that two calibrations foretell; (n,) px, NaN unseen."""
    known = epipolar_px[np.isfinite(epipolar_px)]
    median, worst = float(np.median(known)), int(np.nanargmax(epipolar_px))
    level = "good" if median <= GOOD_PX else "fair" if median <= FAIR_PX else "poor"
    sentence = f"The matches are {median:.2f} px (median) from the position predicted by the two calibrations."
    if epipolar_px[worst] > max(STANDS_OUT * median, FAIR_PX):
        return {"level": "fair" if level == "good" else level, "sentence": sentence,
                "fix": f"Check match {which[worst] + 1}, which is {epipolar_px[worst]:.1f} px off: is it the same "
                       "point in both images?"}
    fix = "" if level == "good" else ("One camera was moved after its calibration, or a lens model is wrong. Calibrate "
                                      "again, starting with the camera whose lines no longer fit.")
    return {"level": level, "sentence": sentence, "fix": fix}


def of_pose(rotation_apart_deg: float, rotation_sigma_deg: float) -> dict[str, Any]:
    """{"level", "sentence", "fix"} of a rotation from matches beside that of two calibrations."""
    sure = rotation_apart_deg > max(SURE_SIGMAS * rotation_sigma_deg, TURNED_DEG)
    sentence = (f"The rotation between the cameras differs by {rotation_apart_deg:.2f}° (± {rotation_sigma_deg:.2f}°) "
                "between the matches and the calibrations. ")
    if sure:
        return {"level": "poor", "sentence": f"{sentence}A camera was rotated, or a lens model is wrong.",
                "fix": "Calibrate again, starting with the camera whose lines no longer fit."}
    return {"level": "good", "sentence": f"{sentence}This is within the uncertainty of the matches.", "fix": ""}
