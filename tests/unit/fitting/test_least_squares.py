"""Levenberg–Marquardt: it finds minima, resists strays when asked, scales, and never returns worse than it got."""

import numpy as np
import pytest

from touchline.fitting.least_squares import minimise

T = np.linspace(0, 4, 40)


def decay(state):
    a, k = state
    with np.errstate(over="ignore"):
        model = a * np.exp(-k * T)
    return model - 5 * np.exp(-0.7 * T), np.stack([np.exp(-k * T), -a * T * np.exp(-k * T)], axis=1)


def move(state, delta):
    return state + delta


@pytest.mark.parametrize("start", [(1.0, 0.1), (20.0, 3.0), (-3.0, 0.5), (5.0, 0.7)])
def test_it_finds_the_minimum(start):
    found = minimise(np.array(start), decay, move)
    np.testing.assert_allclose(found.state, [5, 0.7], atol=1e-7)
    assert found.converged and found.cost < 1e-12


def test_rosenbrock_valley():
    def valley(s):
        return (
            np.array([10 * (s[1] - s[0] ** 2), 1 - s[0]]),
            np.array([[-20 * s[0], 10.0], [-1.0, 0.0]]),
        )

    found = minimise(np.array([-1.2, 1.0]), valley, move, max_steps=200)
    np.testing.assert_allclose(found.state, [1, 1], atol=1e-6)


def test_a_search_in_two_parts_goes_the_way_of_one():
    start = np.array([20.0, 3.0])
    part = minimise(start, decay, move, max_steps=3)
    both = minimise(
        part.state,
        decay,
        move,
        max_steps=5,
        damping=part.damping,
        first=(part.residuals, part.jacobian),
    )
    np.testing.assert_array_equal(both.state, minimise(start, decay, move, max_steps=8).state)


def test_a_step_to_the_other_side_that_gains_nothing_is_not_the_end():
    def arctan(s):
        return np.arctan(s), 1 / (1 + s[:, None] ** 2)

    # Newton's step is to -1.3917
    found = minimise(np.array([1.3917]), arctan, move, tolerance=1e-3, damping=1e-9)
    assert found.converged and found.cost < 1e-4


def test_units_of_the_parameters_do_not_matter():
    units = np.array([1e-6, 1e5])

    def rescaled(state):
        r, j = decay(state / units)
        return r, j / units

    found = minimise(np.array([1.0, 0.1]) * units, rescaled, move)
    np.testing.assert_allclose(found.state / units, [5, 0.7], atol=1e-6)


def test_a_robust_loss_resists_strays():
    line = 2 * T + 1
    seen = line.copy()
    seen[[3, 20, 33]] += 50

    def fit(state):
        return state[0] * T + state[1] - seen, np.stack([T, np.ones_like(T)], axis=1)

    plain, robust = (minimise(np.zeros(2), fit, move, robust_rows=n).state for n in (0, 40))
    assert np.abs(robust - [2, 1]).max() < 0.3 < np.abs(plain - [2, 1]).max()


def test_it_agrees_with_scipy():
    from scipy.optimize import least_squares

    rng = np.random.default_rng(0)
    noise = rng.normal(0, 0.1, T.size)
    theirs = least_squares(
        lambda s: decay(s)[0] + noise, [1.0, 0.1], method="lm", xtol=1e-14, ftol=1e-14
    ).x
    ours = minimise(np.array([1.0, 0.1]), lambda s: (decay(s)[0] + noise, decay(s)[1]), move).state
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_out_of_reach_is_stepped_around():
    def cliff(state):
        if state[0] > 2:
            return np.array([np.nan]), np.array([[1.0]])
        # the derivative lies, so the first step overshoots
        return np.array([state[0] - 1.9]), np.array([[0.2]])

    found = minimise(np.array([0.0]), cliff, move)
    assert found.state[0] == pytest.approx(1.9, abs=1e-3)


def test_a_start_out_of_reach_is_said():
    found = minimise(np.array([1.0]), lambda s: (np.array([np.nan]), np.array([[1.0]])), move)
    assert not found.converged and found.cost == np.inf
