"""The verdict on a fit: one length on the carpet, one level, one sentence; and what keeps it from being good."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import root_mean_square
from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say, stated
from touchline.evaluate.report_types import FigureLevels, Level, SigmaReport, Verdict
from touchline.fitting.ray_camera.camera_prior import HeightJson

# The best level under a warning, by its reason.
BEST_LEVEL: Mapping[str, Level] = {
    "height-contradicted": "poor",
    "residuals-too-large": "poor",
    "unusual-height": "poor",
    "unusual-focal-length": "poor",
    "unusual-aspect": "fair",
    "unusual-principal-point": "fair",
    "misplaced-lines": "fair",
}
GRID = 9  # places each way over the region

GOOD_MM = 5.0  # a ball is 43 mm wide; strategy code does not notice less
FAIR_MM = 15.0  # robots still meet the ball
LEFT_OUT = 2.0  # how much worse a lens predicts whole borders that it has not seen
# an expected error's level is that of what it keeps in 95 of 100 fits, over this: 7.5 and 22.5 mm
SURE = 1.5
LEVELS: tuple[Level, ...] = ("good", "fair", "poor")


@dataclass(frozen=True)
class Doubt:
    """The best level that it allows, and why. scale_mm: how far positions are off if the field is of another size."""

    level: Level
    why: str
    scale_mm: float = 0.0


def worst_doubt(
    warnings: Iterable[Warning], height: HeightJson | None, region: Region
) -> Doubt | None:
    """Return the warning that caps the level lowest; None where none does."""
    capping = [w for w in warnings if w.reason in BEST_LEVEL]
    if not capping:
        return None
    worst = max(capping, key=lambda w: BEST_LEVEL[w.reason] == "poor")
    return Doubt(BEST_LEVEL[worst.reason], worst.text, scale_error_mm(height, region))


def scale_error_mm(height: HeightJson | None, region: Region) -> float:
    """Return how far positions are off, rms mm, if a contradicted height is right: the field is then so much larger."""
    if (
        height is None
        or height["state"] != "contradicted"
        or not height["entered_mm"]
        or not height["points_mm"]
    ):
        return 0.0
    x, y = np.meshgrid(np.linspace(*region.x_mm, GRID), np.linspace(*region.y_mm, GRID))
    return abs(height["entered_mm"] / height["points_mm"] - 1) * root_mean_square(np.hypot(x, y))


@dataclass(frozen=True)
class FitAccuracy:
    """What is known of a fit's errors, mm.

    cv_mm: of points left out, without what the lines themselves are off. sigma: the expected error, as
    uncertainty.py reports it; "known" under "hat" is false where robot tops are a guess. knows_inside: whether anything
    tells of the places between the borders. reaches: whether the lens maps the whole field in sight. apart_mm: how far
    a freer lens, by its title, is from it; is_apart_expected: whether sigma counts that already. doubt: what keeps the
    fit from being better than a level, whatever its errors say. is_height_believed: whether a height was entered that
    the points cannot check.
    """

    cv_mm: float | None
    check_mm: float | None
    sigma: SigmaReport | None
    knows_inside: bool
    is_physical: bool
    reaches: bool
    hat_height_mm: float
    apart_mm: float = 0.0
    freer: str = ""
    is_apart_expected: bool = False
    doubt: Doubt | None = None
    is_height_believed: bool = False


def level_of(mm: float) -> Level:
    """Return good, fair or poor for an error."""
    return "good" if mm <= GOOD_MM else "fair" if mm <= FAIR_MM else "poor"


def level_likely(rms_mm: float, rms_95_mm: float) -> Level:
    """Return the level of an expected error, by what it keeps in 95 of 100 fits as well."""
    return level_of(max(rms_mm, rms_95_mm / SURE))


def worst_level(*levels: Level) -> Level:
    """Return the worst of levels."""
    return max(levels, key=LEVELS.index)


def level_expected(sigma: SigmaReport) -> Level:
    """Return the level of an expected error, on the carpet and at robot tops."""
    parts = (sigma, sigma["hat"]) if "hat" in sigma else (sigma,)
    return worst_level(*(level_likely(part["rms"], part["rms_95"]) for part in parts))


def tops_are_known(mm: float, height_is_known: bool) -> bool:
    """Return whether an expected error at robot tops is a figure: under a guessed height, an unusable one is none."""
    return height_is_known or mm <= FAIR_MM


def fit_verdict(known: FitAccuracy) -> Verdict:
    """Return {"mm", "level", "sentence"}. The worst of the held-out figures and the expected error counts.

    Where a lens knows its error, points left out count only where they contradict it. What a freer lens places
    elsewhere is a part of the length where it is more than a good one may be off. The expected error at robot-top
    height is no part of the length, which is one on the carpet, but it caps the level.
    """
    sigma, cv_mm = known.sigma, known.cv_mm
    expected, expected_95 = (sigma["rms"], sigma["rms_95"]) if sigma else (None, 0.0)
    hat = sigma.get("hat") if sigma else None
    robot_top_mm, robot_top_95_mm = (hat["rms"], hat["rms_95"]) if hat else (0.0, 0.0)
    if (
        known.is_physical
        and expected is not None
        and cv_mm is not None
        and cv_mm <= LEFT_OUT * max(expected, GOOD_MM)
    ):
        # a line left out is predicted worse than it is known once it counts: no sign of a misfit
        cv_mm = None
    figures = [mm for mm in (cv_mm, known.check_mm, expected) if mm is not None]
    if not figures:
        return stated(
            Verdict(
                mm=None,
                level="unknown",
                levels=_levels("unknown", known),
                sentence=say(
                    "verdict.not-validated",
                    "The accuracy is unknown because no points could be cross-validated.",
                ),
            )
        )
    mm = max(figures)
    where = (
        say(
            "verdict.expected",
            "Expected error on the carpet: {mm:mm} mm (95 % below {mm_95:mm} mm).",
            mm=mm,
            mm_95=expected_95,
        )
        if mm == expected
        else say("verdict.checked", "Error on check points: {mm:mm} mm.", mm=mm)
        if mm == known.check_mm
        else say("verdict.cross-validated", "Cross-validated error: {mm:mm} mm.", mm=mm)
    )
    # as in the comparison of all models: what it misses, and what it has elsewhere
    if known.apart_mm > GOOD_MM:
        mm = (
            mm
            if known.is_apart_expected and mm == expected
            else float(np.hypot(mm, known.apart_mm))
        )
        where = say(
            "verdict.contradicted",
            "Error inside the field: {mm:mm} mm. {model} places the field "
            "{apart_mm:.0f} mm away with the same points.",
            mm=mm,
            model=known.freer,
            apart_mm=known.apart_mm,
        )
    elif not known.knows_inside:
        return stated(
            Verdict(
                mm=mm,
                level="unknown",
                levels=_levels("unknown", known),
                sentence=say(
                    "verdict.inside-unknown",
                    "Accuracy inside the field is unknown. The border points fit within {mm:mm} mm, "
                    "but no point inside was used. Add points on the centre circle.",
                    mm=mm,
                ),
            )
        )
    on_carpet = level_likely(mm, expected_95)
    level: Level = "good" if known.reaches else "fair"
    level = worst_level(on_carpet, level_of(robot_top_95_mm / SURE), level)
    told_level, doubt = level, known.doubt
    words = _judgement(level, known)
    if doubt is not None and LEVELS.index(doubt.level) >= LEVELS.index(level):
        told_level, level, words = doubt.level, on_carpet, _doubted(doubt)
    if hat and robot_top_mm > mm and robot_top_95_mm / SURE > GOOD_MM:
        words = _with_robot_tops(
            words, level, on_carpet, robot_top_mm if hat.get("known", True) else None
        )
    if doubt is not None and doubt.scale_mm > mm:
        mm = doubt.scale_mm
        where = join(
            where,
            say(
                "verdict.scale",
                "If the entered height is correct, positions are off by {mm:.0f} mm.",
                mm=mm,
            ),
        )
    believed = (
        say(
            "verdict.height-not-checked",
            "Robot tops rely on the entered height, which the points cannot check.",
        )
        if known.is_height_believed
        else ""
    )
    beyond = (
        ""
        if known.reaches
        else say("verdict.not-covered", "The lens model does not cover the whole field.")
    )
    return stated(
        Verdict(
            mm=mm,
            level=told_level,
            levels=_levels(on_carpet, known),
            sentence=join(words, believed, beyond, where),
        )
    )


def _levels(on_carpet: Level | Literal["unknown"], known: FitAccuracy) -> FigureLevels:
    """Return each figure's own level; what speaks against the whole fit speaks against both."""
    hat = known.sigma.get("hat") if known.sigma else None
    caps: tuple[Level, ...] = (
        "good" if known.reaches else "fair",
        known.doubt.level if known.doubt else "good",
    )
    tops: Level | Literal["unknown"] | None = None
    if hat is not None:
        tops = "unknown"
        if tops_are_known(hat["rms"], hat.get("known", True) is not False):
            tops = worst_level(level_likely(hat["rms"], hat["rms_95"]), *caps)
    return {
        "carpet": on_carpet if on_carpet == "unknown" else worst_level(on_carpet, *caps),
        "robot_tops": tops,
    }


def _doubted(doubt: Doubt) -> Sentence:
    return (
        say("verdict.doubted", "Not reliable. {why}", why=doubt.why)
        if doubt.level == "poor"
        else say("verdict.usable-with-care", "Usable with care. {why}", why=doubt.why)
    )


def _judgement(level: Level, known: FitAccuracy) -> Sentence:
    if level == "good":
        return (
            say("verdict.accurate", "Accurate enough for matches.")
            if known.is_physical
            else say(
                "verdict.accurate-on-carpet",
                "Accurate enough for the ball. Robot tops ({height_mm:g} mm) require a "
                "physical lens model.",
                height_mm=known.hat_height_mm,
            )
        )
    if level == "fair":
        return say(
            "verdict.usable", "Usable. Expect positions to be off by up to {mm:g} mm.", mm=FAIR_MM
        )
    return say(
        "verdict.inaccurate",
        "Not accurate enough for matches: positions inside the field are off by centimetres.",
    )


def _with_robot_tops(
    words: Sentence, level: Level, on_carpet: Level, robot_top_mm: float | None
) -> Sentence:
    """Say how far robot tops are off, or that it is not known, and that the carpet is better where it is."""
    if level == on_carpet:
        if robot_top_mm is None:
            return join(
                words,
                say(
                    "verdict.robot-tops-unknown",
                    "The error at robot tops is unknown, because the camera height is unknown.",
                ),
            )
        return join(
            words,
            say(
                "verdict.robot-tops", "Robot tops may be off by about {mm:.0f} mm.", mm=robot_top_mm
            ),
        )
    begin = (
        say("verdict.usable-only", "Usable in matches.")
        if level == "fair"
        else say("verdict.inaccurate-only", "Not accurate enough for matches.")
    )
    if robot_top_mm is None:
        return join(
            begin,
            say(
                "verdict.accurate-but-robot-tops-unknown",
                "Accurate on the carpet, but the error at robot tops is "
                "unknown, because the camera height is unknown.",
            )
            if on_carpet == "good"
            else say(
                "verdict.usable-but-robot-tops-unknown",
                "Usable on the carpet, but the error at robot tops is unknown, "
                "because the camera height is unknown.",
            ),
        )
    return join(
        begin,
        say(
            "verdict.accurate-but-robot-tops",
            "Accurate on the carpet, but robot tops may be off by about {mm:.0f} mm.",
            mm=robot_top_mm,
        )
        if on_carpet == "good"
        else say(
            "verdict.usable-but-robot-tops",
            "Usable on the carpet, but robot tops may be off by about {mm:.0f} mm.",
            mm=robot_top_mm,
        ),
    )
