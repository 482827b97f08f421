"""Verdicts on the figures of a pair: a level, a sentence, and what to do."""

from collections.abc import Sequence

import numpy as np

from touchline.core.geometry import Array, Indices, Mask, root_mean_square
from touchline.core.statements import Sentence, join, say, stated
from touchline.core.text_format import format_mm
from touchline.evaluate.cameras.own_accuracy import OwnAccuracy, capped_level
from touchline.evaluate.cameras.pair_agreement import PointAgreement
from touchline.evaluate.cameras.rig_verdict import PairVerdict, add_matches
from touchline.evaluate.fit.report_types import Level
from touchline.evaluate.fit.verdict import FAIR_MM, level_of

GOOD_PX, FAIR_PX = 1.0, 3.0  # a careful click is good to half a pixel, and two of them meet
SPREAD_SHARE = 0.5  # of a shift: with less beside it, the shift is the matter
STANDS_OUT = 3.0  # times the median: one place is the matter
FEW_PLACES = 4
FEW_MATCHES = 20  # seven numbers are fitted; fewer matches hardly test them
SURE_SIGMAS = 3.0
TURNED_DEG = 0.1  # less moves nothing by a pixel
NAMED = 6  # matches
WORDS = {"good": say("pair.good", "The two cameras agree."),
         "fair": say("pair.fair", "The two cameras agree roughly. A robot shifts slightly when it passes from one to "
                                  "the other."),
         "poor": say("pair.poor", "The two cameras do not agree.")}


def of_agreement(found: PointAgreement, covered: float, against: Sequence[OwnAccuracy] = ()) -> PairVerdict:
    """covered: the share of the common part that lies near a measured place.

    against: what the calibrations' own reports say against them.
    """
    agreed = _agreement_alone(found, covered)
    level = capped_level(agreed["level"], [own.level for own in against])
    if level == agreed["level"]:
        return agreed
    worst = [own for own in against if own.level == level]
    return _verdict(level, join(*(own.text for own in worst), agreed["sentence"]),
                    join(*(own.fix for own in worst), agreed["fix"]))


def _agreement_alone(found: PointAgreement, covered: float) -> PairVerdict:
    apart = found.apart_mm
    median, worst = float(np.median(apart)), float(apart.max())
    usual = apart[apart <= max(STANDS_OUT * median, FAIR_MM)]  # a mistaken match says nothing about the cameras
    level = level_of(root_mean_square(usual))
    sentence = join(WORDS[level], say("pair.differ", "Median difference {median}, largest {most}.",
                                      median=format_mm(median), most=format_mm(worst)))
    if few := len(apart) - len(usual):
        x, y = found.places[int(np.argmax(apart))]
        outliers = (say("pair.outlier", "1 of {all} is an outlier.", all=len(apart)) if few == 1 else
                    say("pair.outliers", "{n} of {all} are outliers.", n=few, all=len(apart)))
        return _verdict("fair" if level == "good" else level, join(sentence, outliers), say(
            "pair.outliers.fix", "Check the largest difference, at ({x:.0f}, {y:.0f}) mm: is it the same point in both "
            "images, and is its height correct? If so, add points near it and calibrate again.", x=x, y=y))
    if level == "good":
        fix = add_matches() if len(apart) < FEW_PLACES or covered < 0.25 else ""
        return _verdict(level, sentence, fix)
    return _verdict(level, sentence, _cure(found))


def _cure(found: PointAgreement) -> Sentence:
    shift = np.median(found.offset_mm, axis=0)
    spread = root_mean_square(np.linalg.norm(found.offset_mm - shift, axis=1))
    if len(found.places) < FEW_PLACES:
        return say("pair.few-places.fix", "Check these matches and their heights. Then add matches all over the shared "
                                          "area.")
    if spread <= SPREAD_SHARE * float(np.hypot(*shift)):
        return say("pair.shift.fix", "The difference is mainly a shift of ({x:.0f}, {y:.0f}) mm: one camera was moved "
                   "after its calibration, or the given heights are too low. Calibrate the camera whose lines no "
                   "longer fit again.", x=shift[0], y=shift[1])
    return say("pair.spread.fix", "Check the heights of the matched points. If they are correct, enter the height of "
               "both cameras, add points on lines inside the shared area, and compare the lens models.")


def of_fundamental(epipolar_px: Array, good: Mask, which: Indices) -> PairVerdict:
    """Judge a geometry that was found from matches; all (n,), which: as they are counted."""
    rms_px, wrong = root_mean_square(epipolar_px[good]), which[~good]
    level = capped_level(_level_of_px(rms_px), ["fair"] if len(wrong) else [])
    agreed = say("pair.geometry", "{n} of {all} matches agree with one geometry, within {px:.2f} px.",
                 n=int(good.sum()), all=len(good), px=rms_px)
    if len(wrong):
        return _verdict(level, join(agreed, _mistaken(wrong)), say(
            "pair.mistaken.fix", "Check whether they show the same point in both images. Move or remove them."))
    few = int(good.sum()) < FEW_MATCHES
    return _verdict(level, agreed, say(
        "pair.untested.fix", "Add matches. These are too few to test the geometry that was fitted to them.")
        if few else "")


def _mistaken(wrong: Indices) -> Sentence:
    numbers = [str(i + 1) for i in wrong[:NAMED]]
    if len(wrong) == 1:
        return say("pair.mistaken-one", "Match {match} does not.", match=numbers[0])
    if len(wrong) > NAMED:
        return say("pair.mistaken-many", "Matches {matches} and {n} more do not.", matches=numbers,
                   n=len(wrong) - NAMED)
    return say("pair.mistaken", "Matches {matches} and {last} do not.", matches=numbers[:-1], last=numbers[-1])


def of_calibrated(epipolar_px: Array, which: Indices) -> PairVerdict:
    """Judge matches beside the lines that two calibrations foretell; (n,) px, NaN unseen."""
    known = epipolar_px[np.isfinite(epipolar_px)]
    median, worst = float(np.median(known)), int(np.nanargmax(epipolar_px))
    level = _level_of_px(median)
    sentence = say("pair.predicted", "The matches are {px:.2f} px (median) from the position predicted by the two "
                                     "calibrations.", px=median)
    if epipolar_px[worst] > max(STANDS_OUT * median, FAIR_PX):
        return _verdict("fair" if level == "good" else level, sentence, say(
            "pair.predicted-one.fix", "Check match {match}, which is {px:.1f} px off: is it the same point in both "
            "images?", match=int(which[worst]) + 1, px=epipolar_px[worst]))
    fix = "" if level == "good" else say(
        "pair.predicted.fix", "One camera was moved after its calibration, or a lens model is wrong. Calibrate again, "
        "starting with the camera whose lines no longer fit.")
    return _verdict(level, sentence, fix)


def of_pose(rotation_apart_deg: float, rotation_sigma_deg: float) -> PairVerdict:
    """Judge a rotation from matches beside that of two calibrations."""
    sure = rotation_apart_deg > max(SURE_SIGMAS * rotation_sigma_deg, TURNED_DEG)
    sentence = say("pair.rotation", "The rotation between the cameras differs by {deg:.2f}° (± {sigma:.2f}°) between "
                   "the matches and the calibrations.", deg=rotation_apart_deg, sigma=rotation_sigma_deg)
    if sure:
        return _verdict("poor", join(sentence, say(
            "pair.rotated", "A camera was rotated, or a lens model is wrong.")),
            say("pair.rotated.fix", "Calibrate again, starting with the camera whose lines no longer fit."))
    return _verdict("good", join(sentence, say(
        "pair.rotation-alike", "This is within the uncertainty of the matches.")), "")


def _level_of_px(px: float) -> Level:
    return "good" if px <= GOOD_PX else "fair" if px <= FAIR_PX else "poor"


def _verdict(level: Level, sentence: str, fix: str) -> PairVerdict:
    return stated(PairVerdict(level=level, sentence=sentence, fix=fix))
