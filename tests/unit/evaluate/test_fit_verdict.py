"""The verdict on a fit: a level and a sentence that never contradicts the figures beside it."""

from dataclasses import replace

import pytest

from touchline.core.records import Warning
from touchline.evaluate.verdict import FitAccuracy, fit_verdict, tops_are_known, worst_doubt


def accuracy(carpet_mm: float, tops_mm: float | None = None, **others) -> FitAccuracy:
    """Return what is known of a physical lens model whose expected errors, rms, are these."""
    sigma = {"rms": carpet_mm, "rms_95": 1.4 * carpet_mm}
    if tops_mm is not None:
        sigma["hat"] = {"rms": tops_mm, "rms_95": 1.4 * tops_mm}
    known = FitAccuracy(
        None, None, sigma, knows_inside=True, is_physical=True, reaches=True, hat_height_mm=150.0
    )
    return replace(known, **others)


@pytest.mark.parametrize(
    ("carpet_mm", "tops_mm", "level", "begin"),
    [
        (2, 3, "good", "Accurate enough for matches. Expected"),
        (
            2,
            9,
            "fair",
            "Usable in matches. Accurate on the carpet, but robot tops may be off by about 9 mm.",
        ),
        (
            2,
            60,
            "poor",
            "Not accurate enough for matches. Accurate on the carpet, but robot tops may be off by about 60",
        ),
        (
            9,
            12,
            "fair",
            "Usable. Expect positions to be off by up to 15 mm. Robot tops may be off by about 12 mm.",
        ),
        (
            9,
            60,
            "poor",
            "Not accurate enough for matches. Usable on the carpet, but robot tops may be off by about 60",
        ),
        (
            102,
            340,
            "poor",
            "Not accurate enough for matches: positions inside the field are off by centimetres. Robot tops "
            "may be off by about 340 mm. Expected error on the carpet: 102 mm",
        ),
    ],
)
def test_the_carpet_is_called_accurate_only_where_it_is(carpet_mm, tops_mm, level, begin):
    found = fit_verdict(accuracy(carpet_mm, tops_mm))
    assert (found["level"], found["sentence"][: len(begin)]) == (level, begin)
    assert found["mm"] == carpet_mm


@pytest.mark.parametrize(
    ("carpet_mm", "tops_mm", "level", "sentence"),
    [
        (
            2,
            60,
            "poor",
            "Not accurate enough for matches. Accurate on the carpet, but the error at robot tops is unknown, "
            "because the camera height is unknown.",
        ),
        (
            9,
            60,
            "poor",
            "Not accurate enough for matches. Usable on the carpet, but the error at robot tops is unknown, "
            "because the camera height is unknown.",
        ),
        (
            102,
            340,
            "poor",
            "Not accurate enough for matches: positions inside the field are off by centimetres. The error "
            "at robot tops is unknown, because the camera height is unknown.",
        ),
    ],
)
def test_an_error_at_robot_tops_that_is_not_known_is_no_number(carpet_mm, tops_mm, level, sentence):
    known = accuracy(carpet_mm, tops_mm)
    known.sigma["hat"]["known"] = False
    found = fit_verdict(known)
    assert (found["level"], found["sentence"].split(" Expected")[0]) == (level, sentence)


def test_robot_tops_are_a_guess_only_above_a_usable_error_under_an_unknown_height():
    assert [
        tops_are_known(mm, height_known) for mm in (15.0, 15.1) for height_known in (True, False)
    ] == [True, True, True, False]


def test_a_lens_that_ends_before_the_field_is_at_most_fair():
    found = fit_verdict(accuracy(1, 1, reaches=False))
    assert found["level"] == "fair"
    assert "does not cover the whole field. Expected error" in found["sentence"]


@pytest.mark.parametrize(
    ("warned", "level", "begin"),
    [
        (
            ["unusual-principal-point"],
            "fair",
            "Usable with care. Text of unusual-principal-point. Expected",
        ),
        (
            ["misplaced-lines", "unusual-aspect"],
            "fair",
            "Usable with care. Text of misplaced-lines. Expected",
        ),
        (
            ["unusual-aspect", "unusual-height"],
            "poor",
            "Not reliable. Text of unusual-height. Expected",
        ),
        (["residuals-too-large"], "poor", "Not reliable. Text of residuals-too-large. Expected"),
        (["stray-click", "weakly-determined"], "good", "Accurate enough for matches. Expected"),
    ],
)
def test_what_contradicts_a_fit_caps_its_level_whatever_it_expects(warned, level, begin):
    doubt = worst_doubt(
        [Warning(reason, f"Text of {reason}.", "") for reason in warned], None, None
    )
    found = fit_verdict(accuracy(2, 3, doubt=doubt))
    assert (found["level"], found["sentence"][: len(begin)], found["mm"]) == (level, begin, 2)
    assert fit_verdict(accuracy(102, 340, doubt=doubt))["level"] == "poor"


def test_a_freer_lens_elsewhere_counts_into_the_length():
    found = fit_verdict(accuracy(3, 4, apart_mm=40.0, freer="Fisheye"))
    assert found["level"] == "poor"
    assert found["mm"] == pytest.approx(40.1, abs=0.05)
    assert "Fisheye places the field 40 mm away" in found["sentence"]


def test_what_the_sentence_states_stands_beside_it():
    found = fit_verdict(accuracy(2, 9))
    assert [one["code"] for one in found["statements"]["sentence"]] == [
        "verdict.usable-only",
        "verdict.accurate-but-robot-tops",
        "verdict.expected",
    ]
    assert found["statements"]["sentence"][2]["values"] == {"mm": 2.0, "mm_95": 2.8}
    unknown = fit_verdict(
        FitAccuracy(
            None,
            None,
            None,
            knows_inside=False,
            is_physical=False,
            reaches=True,
            hat_height_mm=150.0,
        )
    )
    assert unknown["level"] == "unknown" and unknown["mm"] is None


@pytest.mark.parametrize(
    ("known", "levels"),
    [
        (accuracy(0.3, 4.0), ("good", "good")),
        (accuracy(0.3, 9.0), ("good", "fair")),
        (accuracy(0.3, 40.0), ("good", "poor")),
        (accuracy(4.8, 9.0), ("good", "fair")),
        (accuracy(20.0, 1.0), ("poor", "good")),
        (accuracy(0.3, 1.0, reaches=False), ("fair", "fair")),
        (
            accuracy(
                0.3,
                1.0,
                doubt=worst_doubt(
                    [Warning("residuals-too-large", "Far off.", "Look.")], None, None
                ),
            ),
            ("poor", "poor"),
        ),
        (accuracy(0.3), ("good", None)),
        (accuracy(0.3, 1.0, knows_inside=False), ("unknown", "good")),
    ],
)
def test_each_figure_has_a_level_of_its_own_which_what_speaks_against_the_fit_caps(known, levels):
    found = fit_verdict(known)
    assert (found["levels"]["carpet"], found["levels"]["robot_tops"]) == levels
    assert found["level"] in (*levels, "unknown")


def test_robot_tops_that_are_a_guess_have_no_level():
    known = accuracy(0.3, 60.0)
    known.sigma["hat"]["known"] = False
    assert fit_verdict(known)["levels"] == {"carpet": "good", "robot_tops": "unknown"}
