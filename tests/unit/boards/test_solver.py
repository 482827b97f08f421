"""The arithmetic under a board calibration: starts, derivatives, and the elimination of poses."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import FISHEYE, PLAIN, SIZE, TRUTH, views_of
from touchline.boards.problem import BoardObservations, BoardParameters, BoardProblem, free_mask
from touchline.boards.solver import (
    BoardSolver,
    _normal_equations,
    _step,
    homographies,
    poses_from_rays,
    start_states,
    zhang_intrinsics,
)
from touchline.models import MODELS
from touchline.models.intrinsics import Intrinsics
from touchline.models.rotation import matrix_from_vector

BARE = Intrinsics("brown-conrady", (0.0,) * 8, 900.0, 1.02, SIZE.centre, SIZE)
ALL = {"aspect": True, "centre": True, "warp": True}


def a_state(truth=TRUTH, count=4, noise_px=0.0):
    observations = BoardObservations.of(views_of(truth, count, noise_px=noise_px))
    rays = truth.rays(observations.pixels)
    rotations, shifts = poses_from_rays(rays, observations)
    return BoardParameters(
        truth.lens,
        np.log(truth.focal_px),
        truth.aspect,
        np.array(truth.centre_px),
        np.array(truth.terms, float),
        np.array([1.0, 0.0]),
        rotations,
        shifts,
    ), observations


def test_homographies_map_a_flat_board_exactly():
    observations = BoardObservations.of(views_of(BARE, 5, noise_px=0, bow_mm=(0, 0)))
    flat = np.concatenate(
        [observations.places[..., :2], np.ones((*observations.places.shape[:2], 1))], -1
    )
    seen = flat @ homographies(observations).transpose(0, 2, 1)
    np.testing.assert_allclose(seen[..., :2] / seen[..., 2:], observations.pixels, atol=1e-7)


def test_zhangs_intrinsics_are_exact_without_distortion():
    observations = BoardObservations.of(views_of(BARE, 6, noise_px=0, bow_mm=(0, 0)))
    focal, aspect = zhang_intrinsics(homographies(observations), SIZE)
    assert focal == pytest.approx(900.0, rel=1e-7) and aspect == pytest.approx(1.02, rel=1e-7)


def test_zhang_says_nan_where_views_tell_no_focal_length():
    facing = np.tile(np.array([[2.0, 0, 300], [0, 2.0, 200], [0, 0, 1.0]]), (3, 1, 1))
    facing[:, 2, 0] = 1e-30
    assert (
        np.isnan(zhang_intrinsics(facing, SIZE)[0])
        or not 0.05 < zhang_intrinsics(facing, SIZE)[0] / 1280 < 100
    )


@pytest.mark.parametrize("truth", [TRUTH, FISHEYE], ids=lambda t: t.model)
def test_poses_come_straight_from_rays(truth):
    observations = BoardObservations.of(views_of(truth, 6, noise_px=0, bow_mm=(0, 0)))
    rotations, shifts = poses_from_rays(truth.rays(observations.pixels), observations)
    seen = truth.project(observations.places @ rotations.transpose(0, 2, 1) + shifts[:, None])
    np.testing.assert_allclose(seen, observations.pixels, atol=1e-6)
    assert np.allclose(np.linalg.det(rotations), 1)


def test_poses_hold_for_rays_past_ninety_degrees():
    board = np.array([[x, y, 0.0] for x in range(4) for y in range(3)]) * 100
    rotation = matrix_from_vector(np.array([0.1, 1.9, 0.2]))
    points = board @ rotation.T + np.array([500.0, -20.0, -60.0])
    assert (points[:, 2] < 0).any()
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    observations = BoardObservations(
        np.zeros((1, 12, 2)),
        board[None],
        np.ones((1, 12), bool),
        np.zeros((1, 12, 2)),
        200.0,
        ("",),
    )
    rotations, shifts = poses_from_rays(rays[None], observations)
    np.testing.assert_allclose(rotations[0], rotation, atol=1e-9)
    np.testing.assert_allclose(shifts[0], [500, -20, -60], atol=1e-6)


@pytest.mark.parametrize("truth", [TRUTH, FISHEYE], ids=lambda t: t.model)
def test_one_of_the_starts_is_near_the_truth(truth):
    observations = BoardObservations.of(views_of(truth, 20))
    starts = start_states(MODELS[truth.model], observations, SIZE, distorts=True)
    assert min(abs(np.exp(s.log_focal) / truth.focal_px - 1) for s in starts) < 0.1


@pytest.mark.parametrize("truth", [TRUTH, FISHEYE], ids=lambda t: t.model)
def test_derivatives_agree_with_complex_step(truth):
    """f(x + ih) / h, imaginary: exact to rounding. Turns are checked by a real step, for matrices stay real."""
    state, observations = a_state(truth)
    free = np.ones(len(state.names), bool)
    _, shared, own = state.project_jacobian(observations, free)
    for i, name in enumerate(state.names):
        stepped = state.shared.astype(complex)
        stepped[i] += 1e-30j
        n = 4 + len(state.terms)
        moved = _Complex(
            state.lens,
            stepped[0],
            stepped[1],
            stepped[2:4],
            stepped[4:n],
            stepped[n:],
            state.rotations,
            state.translations_mm.astype(complex),
        )
        np.testing.assert_allclose(
            shared[..., i],
            moved.project(observations).imag / 1e-30,
            rtol=1e-9,
            atol=1e-9,
            err_msg=name,
        )
    for i in range(6):
        step = np.zeros((len(state.rotations), 6))
        step[:, i] = 1e-6 if i < 3 else 1e-3
        ahead, behind = (
            state.retract(np.zeros(len(free)), free, s).project(observations) for s in (step, -step)
        )
        np.testing.assert_allclose(
            own[..., i], (ahead - behind) / (2 * step[0, i]), rtol=1e-5, atol=1e-5
        )


class _Complex(BoardParameters):
    """A state whose numbers may be complex."""


def test_eliminating_poses_gives_the_step_of_the_whole_system():
    state, observations = a_state(noise_px=0.3)
    problem = BoardProblem(observations, free_mask(state, PLAIN, **ALL), SIZE, 0.2)
    residuals, shared, own = linear = problem.linearise(state)
    v, n = len(residuals), shared.shape[-1]
    prior, offset, damping = np.full(n, 0.01), np.linspace(0, 1, n), 1e-3
    delta, own_delta, gain = _step(_normal_equations(linear, None), prior, prior * offset, damping)
    whole = np.zeros((residuals.size + n, n + 6 * v))
    rows = residuals[0].size
    for i in range(v):
        whole[i * rows : (i + 1) * rows, :n] = shared[i].reshape(rows, n)
        whole[i * rows : (i + 1) * rows, n + 6 * i : n + 6 * i + 6] = own[i].reshape(rows, 6)
    whole[residuals.size :, :n] = np.diag(prior)
    right = np.concatenate([residuals.ravel(), prior * offset])
    hessian = whole.T @ whole
    step = -np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), whole.T @ right)
    np.testing.assert_allclose(delta, step[:n], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(own_delta.ravel(), step[n:], rtol=1e-6, atol=1e-9)
    assert gain == pytest.approx(right @ right - np.sum((right + whole @ step) ** 2), rel=1e-6)


def test_padding_does_not_pull():
    """Views of unequal size: ever so much padding, which repeats a corner with its noise, changes nothing."""
    views = [
        v.only(np.random.default_rng(i).random(len(v.pixels)) < 0.5 + 0.1 * i)
        for i, v in enumerate(views_of(count=5, noise_px=0.3))
    ]
    observations = BoardObservations.of(tuple(views))
    assert len({int(p.sum()) for p in observations.present}) > 1
    more = [
        np.concatenate([a, np.repeat(a[:, :1], 150, axis=1)], axis=1)
        for a in (
            observations.pixels,
            observations.places,
            observations.present & False,
            observations.bow_shape,
        )
    ]
    wider = replace(
        observations,
        pixels=more[0],
        places=more[1],
        bow_shape=more[3],
        present=np.concatenate(
            [observations.present, more[2][:, observations.present.shape[1] :]], axis=1
        ),
    )
    state, _ = a_state(count=5, noise_px=0.3)
    found = [
        BoardSolver(SIZE, ALL).solve(s, state, PLAIN, 0.2).minimum.state.shared
        for s in (observations, wider)
    ]
    # mm; where each search stops
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5, atol=1e-4)


def test_many_rotations_are_each_the_one_rotation():
    vectors = np.random.default_rng(0).normal(0, 1, (20, 3))
    vectors[0] = 0
    for matrix, vector in zip(matrix_from_vector(vectors), vectors, strict=True):
        np.testing.assert_allclose(matrix, matrix_from_vector(vector), atol=1e-14)
