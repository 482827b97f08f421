"""A lens from a board, held by the field's fit: fast, or with its own σ; and its record."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import SIZE as BOARD_SIZE
from tests.support.board_views import TRUTH, views_of
from tests.support.operator import (
    REGION,
    SIZE,
    carpet_and_hat_mm,
    fitted,
    reference_camera,
    true_camera,
)
from tests.support.tiers import long
from touchline.boards.fit import fit_board
from touchline.core.errors import BadInput
from touchline.core.field import ROBOT_TOP_MM
from touchline.core.geometry import ImageSize
from touchline.evaluate.uncertainty import expected_error, grid_over
from touchline.fitting.ray_camera.lens_prior import (
    DistortionEstimate,
    camera_intrinsics,
    lens_prior,
    read_lens,
)
from touchline.models import MODELS, parameters_json
from touchline.models.distortion import Distortion, half_diagonal_px
from touchline.models.intrinsics import Intrinsics
from touchline.models.lenses.brown_conrady import BrownConradyLens
from touchline.models.lenses.division import DivisionLens
from touchline.models.lenses.kannala_brandt import KannalaBrandtLens

CAMERA = reference_camera("strong", 0)


@pytest.fixture(scope="module")
def board_lens() -> Intrinsics:
    """The reference camera's lens, from twenty views of a board."""
    truth = camera_intrinsics(true_camera(CAMERA))
    assert truth.image_size == SIZE == BOARD_SIZE
    return fit_board(views_of(truth, 20, seed=5), SIZE, MODELS["brown-conrady"]).lens


def option(lens: Intrinsics, sigma: str = "0") -> dict:
    return {
        "lens": {"name": lens.model, "lens": json.loads(json.dumps(lens.to_json()))},
        "lens_sigma": sigma,
    }


@pytest.mark.parametrize("sigma", ["0", "own"])
def test_a_lens_from_a_board_replaces_the_tape(board_lens, sigma):
    """Straight down without a height, the clicks alone cannot tell hat height; the board's focal length does."""
    errors = [
        carpet_and_hat_mm(fitted(CAMERA, seed, tape=False, **option(board_lens, sigma)), CAMERA)
        for seed in range(4)
    ]
    told = [
        expected_error(fitted(CAMERA, seed, tape=False, **more), REGION, ROBOT_TOP_MM).rms
        for more in (option(board_lens, sigma), {})
        for seed in range(4)
    ]
    carpet, hat = np.median(errors, axis=0)
    assert carpet < 1.6 and hat < 1.8 and np.median(told[:4]) < np.median(told[4:]) / 5


def test_a_lens_held_fast_stays_and_one_with_sigma_moves_within_it(board_lens):
    fitted_fast = fitted(CAMERA, 0, **option(board_lens))
    fast = fitted_fast.model
    assert fast.lens_terms == board_lens.terms and fast.focal_px == pytest.approx(
        board_lens.focal_px, rel=1e-12
    )
    own = fitted(CAMERA, 0, **option(board_lens, "own"))
    moved = np.log(own.model.focal_px / board_lens.focal_px) / board_lens.sigma["log_focal"]
    assert 1e-6 < abs(moved) < 4
    # what the board tells costs the clicks nothing: their spread is judged as if the lens were held
    assert own.notes["click_sigma_px"] == pytest.approx(
        fitted_fast.notes["click_sigma_px"], rel=0.05
    )
    assert "log_focal" in own.parameter_names and own.model.aspect == board_lens.aspect


def test_terms_that_straight_lines_told_stay_where_the_options_name_fewer():
    true = true_camera(CAMERA)
    scale = half_diagonal_px(SIZE) / true.focal_px
    terms = tuple(t * scale**p for t, p in zip(true.lens_terms, true.LENS.POWERS, strict=True))
    bend = Distortion("brown-conrady", terms, true.centre_px, SIZE)
    known = DistortionEstimate(bend, ("k1", "k2"), np.diag([1e-3, 1e-3]) ** 2)
    fit = fitted(CAMERA, 0, terms=["k1"], lens={"name": bend.name, "lens": known.to_json()})
    at = true.LENS.TERMS.index("k2")
    assert (
        fit.model.lens_terms[at] == pytest.approx(true.lens_terms[at], abs=0.01)
        and true.lens_terms[at]
    )


def test_the_lenss_own_error_is_in_the_expected_one(board_lens):
    region = true_camera(CAMERA).region
    fast, own = (
        expected_error(fitted(CAMERA, 0, **option(board_lens, s)), region, ROBOT_TOP_MM).rms
        for s in ("0", "own")
    )
    assert fast < own < 10 * fast


def test_a_wrong_lens_is_corrected_by_clicks_only_where_its_sigma_lets_them(board_lens):
    """k1 off by a σ that is a hundredfold the board's: held fast it spoils the carpet."""
    camera = reference_camera("strong", 8)
    wide = tuple(tuple(1e4 * v for v in row) for row in board_lens.covariance)
    wrong = replace(
        board_lens,
        covariance=wide,
        terms=(board_lens.terms[0] + 100 * board_lens.sigma["k1"], *board_lens.terms[1:]),
    )
    fast, own = (
        carpet_and_hat_mm(fitted(camera, 1, **option(wrong, s)), camera)[0] for s in ("0", "own")
    )
    assert own < fast / 2


def test_the_joint_prior_is_the_covariances_square(board_lens):
    prior = lens_prior(board_lens, {"lens_sigma": "own"})
    chosen = [board_lens.estimated.index(name) for name in prior.names]
    covariance = np.array(board_lens.covariance)[np.ix_(chosen, chosen)]
    step = np.linalg.cholesky(covariance) @ np.random.default_rng(0).normal(0, 1, len(chosen))
    found = board_lens.values | dict(zip(prior.names, prior.values + step, strict=True))
    assert np.sum(prior.residuals(found) ** 2) == pytest.approx(
        step @ np.linalg.solve(covariance, step), rel=1e-4
    )
    assert "aspect" not in prior.names


@pytest.mark.parametrize(
    ("lens", "terms"),
    [
        (BrownConradyLens, (-0.2, 0.05, 0.001, 0.0, -0.02, 0.0, 0.0, 0.0)),
        (KannalaBrandtLens, (0.29, 0.1, 0.06, 0.02)),
        (DivisionLens, (-0.2,)),
    ],
)
def test_terms_at_another_focal_length_bend_alike(lens, terms):
    terms, s = np.array(terms), 0.1
    there, by_terms, by_scale = lens.at_scale(terms, s)
    plane = np.stack(
        np.meshgrid(np.linspace(-0.3, 0.3, 5), np.linspace(-0.2, 0.2, 4)), axis=-1
    ).reshape(-1, 2)
    one = np.ones((len(plane), 1))
    here = lens.distort(terms, np.concatenate([plane, one], axis=1))
    longer = lens.distort(there, np.concatenate([plane * np.exp(-s), one], axis=1)) * np.exp(s)
    assert longer == pytest.approx(here, abs=2e-6)
    for k, step in enumerate(1e-6 * np.eye(len(terms))):
        assert (lens.at_scale(terms + step, s)[0] - there) / 1e-6 == pytest.approx(
            by_terms[:, k], abs=1e-4
        )
    assert (lens.at_scale(terms, s + 1e-6)[0] - there) / 1e-6 == pytest.approx(by_scale, abs=1e-4)


@pytest.mark.parametrize("model", ["fisheye", "brown-conrady"])
def test_a_lens_whose_focal_length_is_hardly_known_may_be_another_one_that_bends_alike(model):
    lens = MODELS[model].LENS
    terms = np.array(
        (0.3, 0.1, 0.05, 0.02) if model == "fisheye" else (-0.2, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    )
    names = ("log_focal", "k1")
    slope = lens.at_scale(terms, 0.0)[2][0]
    covariance = np.array(
        [[0.3**2, 0.3**2 * slope], [0.3**2 * slope, (0.3 * slope) ** 2 + 1e-3**2]]
    )
    known = Intrinsics(
        model,
        tuple(terms),
        1000.0,
        1.0,
        (500.0, 400.0),
        ImageSize(1001, 801),
        names,
        tuple(map(tuple, covariance)),
    )
    prior = lens_prior(known, {"lens_sigma": "own"})
    alike = dict(zip(lens.TERMS, lens.at_scale(terms, 0.3)[0], strict=True))
    assert np.linalg.norm(
        prior.residuals({"log_focal": np.log(1000) + 0.3, **alike})
    ) == pytest.approx(1.0, abs=0.05)
    found = known.values | {"log_focal": np.log(1100.0)}
    names = list(found)
    numeric = [
        (prior.residuals(found | {n: found[n] + 1e-6}) - prior.residuals(found)) / 1e-6
        for n in names
    ]
    np.testing.assert_allclose(
        prior.jacobian(names, found), np.transpose(numeric), rtol=1e-3, atol=1e-2
    )


def taken_over(fit) -> dict:
    """The lens of an ordinary calibration, as well as its clicks told it."""
    covariance = {"names": list(fit.parameter_names), "matrix": fit.covariance.tolist()}
    return {
        "lens": {
            "name": fit.model.NAME,
            "parameters": parameters_json(fit.model),
            "covariance": covariance,
        },
        "lens_sigma": "own",
    }


@pytest.mark.parametrize(
    ("centre", "hat_mm", "seeds", "within"),
    [
        ({}, 3.2, 8, 0.4),  # so few tell the error to 15 %
        long({"centre_sigma_px": 0.0}, 2.2, 40, 0.15),
        long({}, 3.2, 40, 0.15),
    ],
)
def test_a_lens_calibrated_at_one_pose_is_held_at_another_with_an_honest_error(
    centre, hat_mm, seeds, within
):
    """Tilted by 15° first, straight down without a tape afterwards; on the carpet and at hat height."""
    there, here, terms = reference_camera("strong", 15), CAMERA, ("k1", "k2")
    places, seen, told = grid_over(REGION, 21, 17), [], []
    for seed in range(seeds):
        fit = fitted(
            here, 1000 + seed, tape=False, **taken_over(fitted(there, seed, terms=terms, **centre))
        )
        seen.append(carpet_and_hat_mm(fit, here))
        told.append([expected_error(fit, REGION, z, places).rms for z in (0.0, ROBOT_TOP_MM)])
    seen, told = (np.sqrt(np.mean(np.square(x), axis=0)) for x in (seen, told))
    np.testing.assert_allclose(seen / told, 1, atol=within)
    assert seen[1] < hat_mm  # the clicks alone leave 9


def test_of_a_calibrations_covariance_only_the_lenss_part_is_held():
    fit = fitted(CAMERA, 0, terms=("k1",))
    lens = read_lens(fit.model.NAME, taken_over(fit), SIZE)
    assert lens.estimated == ("log_focal", "aspect", "centre_x", "centre_y", "k1")
    assert lens.sigma["k1"] == pytest.approx(
        np.sqrt(fit.covariance[fit.parameter_names.index("k1")][fit.parameter_names.index("k1")])
    )


def test_a_calibration_that_held_its_lens_fast_cannot_tell_how_well_it_is_known(board_lens):
    pose_only = fitted(CAMERA, 0, **option(board_lens))
    with pytest.raises(BadInput, match="used a fixed lens itself") as refusal:
        fitted(CAMERA, 0, **taken_over(pose_only))
    assert refusal.value.reason == "lens-sigma-unknown" and "board" in refusal.value.fix
    passed_on = fitted(CAMERA, 0, **taken_over(fitted(CAMERA, 1, **option(board_lens, "own"))))
    assert "log_focal" in passed_on.parameter_names


@pytest.mark.parametrize(
    "covariance",
    [
        5,
        [],
        {},
        {"names": ["log_focal"]},
        {"names": ["log_focal"], "matrix": [[float("nan")]]},
        {"names": ["log_focal"], "matrix": [[-1.0]]},
        {"names": ["log_focal", "k1"], "matrix": [[1.0]]},
        {"names": ["k1", "k1"], "matrix": [[1.0, 0.0], [0.0, 1.0]]},
        {"names": [[1]], "matrix": [[1.0]]},
        {"names": ["k1"], "matrix": [["x"]]},
        {"names": 3, "matrix": 3},
    ],
)
def test_a_covariance_that_is_none_is_refused(covariance):
    taken = {
        "lens": {
            "name": "brown-conrady",
            "parameters": parameters_json(true_camera(CAMERA)),
            "covariance": covariance,
        }
    }
    with pytest.raises(BadInput, match="covariance"):
        fitted(CAMERA, 0, **taken, lens_sigma="own")


def test_what_does_not_fit_the_picture_or_the_model_is_refused(board_lens):
    with pytest.raises(BadInput, match="division"):
        fitted(CAMERA, 0, "division", **option(board_lens))
    small = replace(board_lens, image_size=type(SIZE)(640, 512))
    with pytest.raises(BadInput, match="640 × 512"):
        fitted(CAMERA, 0, **option(small))
    taken = {"lens": {"name": "brown-conrady", "parameters": parameters_json(true_camera(CAMERA))}}
    with pytest.raises(BadInput, match="The uncertainty of the lens is unknown"):
        fitted(CAMERA, 0, **taken, lens_sigma="own")
    with pytest.raises(BadInput):
        fitted(CAMERA, 0, lens={"name": "brown-conrady", "lens": {"model": "brown-conrady"}})


def test_a_lens_survives_its_json_exactly(board_lens):
    assert Intrinsics.from_json(json.loads(json.dumps(board_lens.to_json()))) == board_lens
    assert Intrinsics.from_json(TRUTH.to_json()) == TRUTH


@pytest.mark.parametrize(
    "change",
    [
        {"model": "polynomial"},
        {"model": "../x"},
        {"terms": [0.1]},
        {"focal_px": -3},
        {"focal_px": float("nan")},
        {"aspect": 0},
        {"centre_px": [1]},
        {"estimated": ["k1"]},
        {"estimated": ["log_focal"], "covariance": [[-1.0]]},
        {"estimated": ["nonsense"], "covariance": [[1.0]]},
        {"more": 1},
        {"image_size": [3, 4]},
        {"terms": None},
        {"estimated": ["k1", "k2"], "covariance": [[1.0, 2.0], [0.0, 1.0]]},
    ],
)
def test_what_is_no_lens_is_refused(change):
    from touchline.core.errors import TouchlineError

    with pytest.raises(TouchlineError):
        Intrinsics.from_json({**TRUTH.to_json(), **change})


def test_a_lens_projects_and_looks_back():
    grid = np.stack(np.meshgrid(np.linspace(0, 1279, 9), np.linspace(0, 1023, 7)), -1)
    rays = TRUTH.rays(grid)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1)
    np.testing.assert_allclose(TRUTH.project(rays * 3.0), grid, atol=1e-8)
