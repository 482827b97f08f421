"""One border: a curve that fits, says how it chose its degree, and names strays instead of bending to them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tiers import rounds
from touchline.core.errors import FitFailed
from touchline.fitting.border import fit_curve
from touchline.models.polynomial import Curve

SPAN = (-0.5, 1023.5)
ROWS = np.linspace(40, 980, 9)


def bowed(y, bow=40.0, skew=3.0, quartic=0.0):
    t = (y - 511.5) / 512
    return 100 + skew * t + bow * t**2 + quartic * t**4


def fitted(y, x, degree="auto", **options):
    return fit_curve(np.asarray(y, float), np.asarray(x, float), degree, SPAN, "left", **options)


@pytest.mark.parametrize("degree", range(1, 9))
def test_exact_points_of_its_degree_are_met_exactly(degree):
    t = (ROWS - 511.5) / 512
    x = 300 + sum((-1) ** k * 20 / (k + 1) * t**k for k in range(1, degree + 1))
    fit = fitted(ROWS, x, degree)
    assert np.abs(fit.residuals).max() < 1e-9
    assert fit.curve.degree == degree


@pytest.mark.parametrize("degree", [1, 3, "auto"])
def test_a_border_that_is_exactly_straight_keeps_its_degree(degree):
    """Its higher coefficients may be exactly nought: a fit with the degree that was found must still be one."""
    fit = fit_curve(np.linspace(60, 400, 7), np.zeros(7), degree, (0, 479), "left")
    assert fit.curve.degree == (1 if degree == "auto" else degree)


def test_the_plain_coefficients_are_the_same_curve():
    curve = Curve((300.0, -20.0, 35.0, 4.0, -2.0), 511.5, 512.0)
    plain = np.polynomial.Polynomial(curve.plain_coefficients())
    np.testing.assert_allclose(plain(ROWS), curve(ROWS), atol=1e-8)


def test_held_out_residuals_are_those_of_a_fit_without_the_point():
    x = bowed(ROWS) + np.random.default_rng(1).normal(0, 0.3, ROWS.size)
    fit = fitted(ROWS, x, 3, robust=False)
    for i in range(ROWS.size):
        without = fitted(np.delete(ROWS, i), np.delete(x, i), 3, robust=False)
        assert fit.held_out[i] == pytest.approx(x[i] - without.curve(ROWS[i]), abs=1e-9)


@pytest.mark.parametrize("count", [9, 13, 20])
@pytest.mark.parametrize(
    "bow, quartic, true_degree", [(0.0, 0.0, 1), (40.0, 0.0, 2), (5.0, 0.0, 2), (40.0, 25.0, 4)]
)
def test_the_automatic_degree_costs_little_against_knowing_it(count, bow, quartic, true_degree):
    """True error of the whole curve, rms over 40 seeds, against that of the true degree; seen: 1.00 to 1.12."""
    rows, everywhere = np.linspace(30, 990, count), np.linspace(0, 1023, 101)
    errors = {"auto": [], true_degree: []}
    for seed in range(40):
        clicks = bowed(rows, bow, 3.0, quartic) + np.random.default_rng(seed).normal(0, 0.3, count)
        for degree, found in errors.items():
            found.append(
                fitted(rows, clicks, degree).curve(everywhere)
                - bowed(everywhere, bow, 3.0, quartic)
            )
    automatic, known = (np.sqrt(np.mean(np.square(e))) for e in errors.values())
    assert automatic <= 1.2 * known


def test_the_automatic_degree_says_why():
    rows = np.linspace(30, 990, 13)
    bent = fitted(
        rows, bowed(rows, quartic=25.0) + np.random.default_rng(0).normal(0, 0.3, rows.size)
    )
    assert bent.curve.degree == 4
    assert bent.reason.startswith("Chosen automatically") and "Degree 3 is worse" in bent.reason


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("stray", range(9))
def test_one_stray_click_is_named_wherever_it_is(stray, seed):
    rng = np.random.default_rng(seed)
    x = bowed(ROWS) + rng.normal(0, 0.3, ROWS.size)
    x[stray] += 15
    for degree in ("auto", 2):
        fit = fitted(ROWS, x, degree)
        assert np.flatnonzero(~fit.inliers).tolist() == [stray]
        assert fit.residuals[stray] == pytest.approx(15, abs=3)


@pytest.mark.parametrize("pair", [(0, 1), (3, 4), (7, 8), (0, 8), (2, 6)])
def test_two_strays_cannot_hide_each_other(pair):
    x = bowed(ROWS) + np.random.default_rng(3).normal(0, 0.3, ROWS.size)
    x[list(pair)] += 12
    assert np.flatnonzero(~fitted(ROWS, x, 2).inliers).tolist() == list(pair)


@pytest.mark.parametrize("seed", range(100))
def test_honest_clicks_are_hardly_ever_called_strays(seed):
    rng = np.random.default_rng(1000 + seed)
    noise = rng.choice([0.1, 0.3, 1.0])
    x = bowed(ROWS, quartic=5.0) + rng.normal(0, noise, ROWS.size)
    for degree in ("auto", 2, 3, 4):
        assert fitted(ROWS, x, degree).inliers.sum() >= ROWS.size - (noise == 1.0)


def test_a_stray_is_kept_when_asked():
    x = bowed(ROWS)
    x[4] += 15
    assert fitted(ROWS, x, 2, robust=False).inliers.all()


def test_many_detected_points_with_many_strays_are_sorted_out():
    rng = np.random.default_rng(0)
    rows = np.linspace(20, 1000, 900)
    x = bowed(rows) + rng.normal(0, 0.3, rows.size)
    wrong = rng.choice(rows.size, 120, replace=False)
    x[wrong] += rng.uniform(8, 60, wrong.size)
    fit = fitted(rows, x, 3)
    assert set(wrong) <= set(np.flatnonzero(~fit.inliers))
    assert fit.inliers.sum() > 0.84 * rows.size
    assert fit.rms < 0.35


def test_a_second_click_on_one_place_neither_counts_nor_harms():
    rows = np.linspace(20, 1000, 9)
    x = 100 + 1e-4 * (rows - 500) ** 2 + np.random.default_rng(2).normal(0, 0.5, 9)
    x[4] += 30
    once, twice = (
        fitted(rows, x, 3),
        fitted([*rows, rows[4], rows[2] + 0.2], [*x, x[4] + 0.3, x[2]], 3),
    )
    assert twice.curve == once.curve and np.array_equal(twice.held_out[:9], once.held_out)
    assert twice.inliers.tolist() == [*once.inliers, False, True] and not once.inliers[4]
    assert twice.residuals[9] == pytest.approx(once.residuals[4] + 0.3)


@pytest.mark.parametrize(
    "y, x, degree, reason",
    [
        ([10, 20], [5, 5], 3, "too-few-points"),
        ([10, 500], [5, 5], "auto", "too-few-points"),
        ([], [], 1, "too-few-points"),
        ([10, 10.2, 300, 300], [5, 5.1, 6, 6], 2, "too-few-points"),
        ([10, 11, 12, 13], [5, 50, 100, 150], 2, "collinear-points"),
        ([10, 10, 500, 500], [5, 50, 5, 50], 3, "collinear-points"),
    ],
)
def test_points_that_cannot_do_are_refused_by_name(y, x, degree, reason):
    with pytest.raises(FitFailed) as refusal:
        fitted(y, x, degree)
    assert refusal.value.reason == reason
    assert refusal.value.fix


@pytest.mark.parametrize("y, x", [([10, 20], [5, 5]), ([10, 11, 12, 13], [5, 50, 100, 150])])
def test_a_refusal_names_its_border_in_words_and_by_its_id(y, x):
    for border, called in (("left", "the left border"), (None, "the border")):
        with pytest.raises(FitFailed) as refusal:
            fit_curve(np.array(y, float), np.array(x, float), 2, SPAN, border)
        assert refusal.value.details["feature"] == border
        assert called in f"{refusal.value}".lower()


@rounds("examples", 60, 300)
def test_whatever_finite_points_come_it_answers_or_refuses(examples):
    @settings(max_examples=examples, deadline=None)
    @given(
        st.lists(st.tuples(st.floats(-1e7, 1e7), st.floats(-1e7, 1e7)), max_size=24),
        st.one_of(st.just("auto"), st.integers(1, 8)),
    )
    def answers_or_refuses(points, degree):
        points = np.array(points, float).reshape(-1, 2)
        try:
            fit = fitted(points[:, 0], points[:, 1], degree)
        except FitFailed as refusal:
            assert refusal.fix
        else:
            assert np.isfinite(fit.curve.coefficients).all() and np.isfinite(fit.residuals).all()

    answers_or_refuses()
