"""The homography: eight numbers from points anywhere along lines, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.fields import FULL, plain_field, seen
from tests.support.tiers import long
from touchline.core.errors import FitFailed
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation
from touchline.fitting.homography import HomographyFitter
from touchline.fitting.sensitivity import HomographyParameters
from touchline.models import field_from_raw, parameters_json, raw_from_field
from touchline.models.homography import Homography

SIZE = ImageSize(1280, 1024)
FIELD = plain_field()
DOWN, TILTED, _ = plain_examples("homography")
NOISE_PX = 0.3


def clicks(model, per_border=9, seed=0, noise_px=NOISE_PX):
    return seen(model, FULL, per_border, noise_px=noise_px, rng=np.random.default_rng(seed))


def carpet_error_mm(model, truth):
    places = np.stack(
        np.meshgrid(np.linspace(-1900, 1900, 15), np.linspace(-1400, 1400, 11)), axis=-1
    )
    return np.linalg.norm(field_from_raw(model, raw_from_field(truth, places)) - places, axis=-1)


def circle_seen(model, count=24, noise_px=0.0, seed=0):
    places = FIELD.arcs["circle"].sample(count + 1)[:-1]
    noise = np.random.default_rng(seed).normal(0, noise_px, places.shape)
    return Observation("circle", "line", raw_from_field(model, places) + noise)


@pytest.mark.parametrize("truth", [DOWN, TILTED], ids=["down", "tilted"])
def test_noise_costs_a_millimetre_not_more(truth):
    errors = [
        np.sqrt(
            np.mean(
                carpet_error_mm(
                    HomographyFitter.fit(clicks(truth, seed=seed), FIELD, FULL, SIZE).model, truth
                )
                ** 2
            )
        )
        for seed in range(8)
    ]
    assert np.median(errors) < 1.2  # mm: 0.3 px are 1.4 mm here, and 36 clicks share eight unknowns


# 20 draws tell σ to 16 %, 60 to 9 %
@pytest.mark.parametrize(("seeds", "within"), [(20, 0.4), long(60, 0.25)])
def test_the_stated_sigma_is_the_one_that_is_seen(seeds, within):
    """The covariance carried to the field's corners, against the scatter of fits."""
    corners = np.array([[-2000, -1500], [2000, -1500], [-2000, 1500], [2000, 1500.0]])
    moved, told = [], []
    for seed in range(seeds):
        fit = HomographyFitter.fit(
            clicks(TILTED, seed=seed), FIELD, FULL, SIZE, {"click_sigma_px": NOISE_PX}
        )
        moved.append(field_from_raw(fit.model, raw_from_field(TILTED, corners)) - corners)
        _, by_point, by = HomographyParameters.of(fit.model).project_jacobian(
            np.hstack([corners, np.zeros((4, 1))])
        )
        by_field = np.linalg.solve(by_point[:, :, :2], by)
        told.append(np.einsum("nij,jk,nik->ni", by_field, fit.covariance, by_field))
    seen_sigma = np.sqrt(np.mean(np.square(moved), axis=0))
    np.testing.assert_allclose(seen_sigma, np.sqrt(np.mean(told, axis=0)), rtol=within)


def test_the_derivatives_are_those_of_the_projection():
    """Central differences: the step's square and the digits it eats balance near 1e-5."""
    state = HomographyParameters.of(TILTED)
    points = np.array([[100.0, -900.0, 0.0], [-1800.0, 1200.0, 0.0]])
    _, by_point, by = state.project_jacobian(points)
    step = 1e-5
    for n in range(8):
        ahead, behind = (
            state.retract(s * np.eye(8)[n], np.ones(8, bool)).project_jacobian(points)[0]
            for s in (step, -step)
        )
        np.testing.assert_allclose(by[:, :, n], (ahead - behind) / (2 * step), atol=1e-5)
    for axis in range(2):
        move = np.eye(3)[axis]
        ahead, behind = (state.project_jacobian(points + s * move)[0] for s in (1.0, -1.0))
        np.testing.assert_allclose(by_point[:, :, axis], (ahead - behind) / 2, rtol=1e-5, atol=1e-7)


def test_an_arc_helps_as_much_as_lines_do():
    few = clicks(TILTED, per_border=3, seed=4)
    alone = HomographyFitter.fit(few, FIELD, FULL, SIZE, {"click_sigma_px": NOISE_PX})
    helped = HomographyFitter.fit(
        (*few, circle_seen(TILTED, noise_px=NOISE_PX)),
        FIELD,
        FULL,
        SIZE,
        {"click_sigma_px": NOISE_PX},
    )
    assert np.trace(helped.covariance) < 0.8 * np.trace(alone.covariance)
    assert np.sqrt(np.mean(carpet_error_mm(helped.model, TILTED) ** 2)) < 2.5


@pytest.mark.parametrize("far_px", [8.0, 60.0, 400.0])
def test_strays_are_named_and_left_out(far_px):
    observations = list(clicks(TILTED))
    spoilt = observations[0].points.copy()
    spoilt[4, 0] += far_px
    observations[0] = replace(observations[0], points=spoilt)
    fit = HomographyFitter.fit(tuple(observations), FIELD, FULL, SIZE)
    assert [(w.reason, w.feature, w.index) for w in fit.warnings] == [("stray-click", "left", 4)]
    assert fit.inliers[0].tolist() == [k != 4 for k in range(9)]
    assert carpet_error_mm(fit.model, TILTED).max() < 5


def test_four_wild_clicks_among_thirty_six_are_found():
    """So many bend the linear start beyond what the refinement mends, in one case of three."""
    right = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        observations = list(clicks(TILTED, seed=seed))
        for i in range(4):
            spoilt = observations[i].points.copy()
            spoilt[rng.integers(9)] = rng.uniform([0, 0], tuple(SIZE))
            observations[i] = replace(observations[i], points=spoilt)
        fit = HomographyFitter.fit(tuple(observations), FIELD, FULL, SIZE)
        right += carpet_error_mm(fit.model, TILTED).max() < 6
    assert right >= 11


def test_points_above_the_carpet_are_left_out_and_said_so():
    hat = Observation((0.0, 0.0), "landmark", np.array([[640.0, 400.0]]), z_mm=150.0)
    with_hat = HomographyFitter.fit((*clicks(DOWN), hat), FIELD, FULL, SIZE)
    assert with_hat.used == (True, True, True, True, False)
    assert [w.reason for w in with_hat.warnings] == ["above-the-carpet"]
    assert with_hat.model == HomographyFitter.fit(clicks(DOWN), FIELD, FULL, SIZE).model


def test_a_mirrored_field_is_refused():
    swapped = {"left": "right", "right": "left"}
    observations = tuple(
        replace(o, feature=swapped.get(o.feature, o.feature)) for o in clicks(TILTED)
    )
    with pytest.raises(FitFailed) as refusal:
        HomographyFitter.fit(observations, FIELD, FULL, SIZE)
    assert refusal.value.reason == "mirrored"


@pytest.mark.parametrize(
    "names",
    [("left", "right", "top"), ("left", "right", "at-x-1", "at-x-3"), ("top", "bottom", "left")],
)
@pytest.mark.parametrize("noise_px", [0.0, NOISE_PX, 3.0])  # px; at 3 the equations look sound
def test_lines_that_are_not_enough_are_refused_with_or_without_noise(names, noise_px):
    rng = np.random.default_rng(3)
    observations = []
    for name in names:
        places = raw_from_field(TILTED, FIELD.feature(name, FULL).sample(12))
        observations.append(
            Observation(name, "line", places + rng.normal(0, noise_px, places.shape))
        )
    with pytest.raises(FitFailed) as refusal:
        HomographyFitter.fit(tuple(observations), FIELD, FULL, SIZE)
    assert refusal.value.reason in ("lines-not-enough", *(["no-camera"] if noise_px > 1 else []))


def test_clicks_in_one_corner_do_not_tell_where_the_far_corner_is():
    rng = np.random.default_rng(1)
    near = [
        ("left", (-2000, -1500), (-2000, -1200)),
        ("at-x-0", (-1600, -1500), (-1600, -1200)),
        ("bottom", (-2000, -1500), (-1600, -1500)),
        ("at-y-0", (-2000, -1200), (-1600, -1200)),
    ]
    observations = []
    for name, start, end in near:
        places = raw_from_field(TILTED, np.linspace(start, end, 6)) + rng.normal(
            0, NOISE_PX, (6, 2)
        )
        observations.append(Observation(name, "line", places))
    with pytest.raises(FitFailed, match=r"corner is uncertain by [0-9.e+]+ mm") as refusal:
        HomographyFitter.fit(tuple(observations), FIELD, FULL, SIZE)
    assert refusal.value.reason == "lines-not-enough"


def test_all_points_on_one_line_are_refused():
    on_one = np.stack([np.linspace(100, 1100, 9), np.linspace(200, 700, 9)], axis=1)
    observations = tuple(Observation(name, "line", on_one) for name in BORDERS)
    with pytest.raises(FitFailed) as refusal:
        HomographyFitter.fit(observations, FIELD, FULL, SIZE)
    assert refusal.value.reason in ("lines-not-enough", "no-camera", "mirrored")


def test_a_click_outside_the_picture_is_named():
    outside = (*clicks(DOWN), Observation("circle", "line", np.array([[1400.0, 10.0]])))
    with pytest.raises(FitFailed) as refusal:
        HomographyFitter.fit(outside, FIELD, FULL, SIZE)
    assert refusal.value.reason == "outside-picture"


def test_beyond_the_horizon_there_is_no_carpet():
    horizon = Homography(
        TILTED.field_from_raw, TILTED.width_px, TILTED.height_px, 10, 8, FULL, SIZE
    )
    up = np.array([0.0, 1e6])  # field mm, far before the camera: nearly the vanishing point
    towards = raw_from_field(horizon, up[None])[0]
    middle = np.array(SIZE.centre)
    beyond = towards + 0.2 * (towards - middle)
    assert np.isnan(horizon.corrected_from_raw(beyond)).all()
    assert np.isfinite(horizon.corrected_from_raw(middle)).all()
    behind = horizon.corrected_from_field(np.array([0.0, -1e5]))
    assert np.isnan(horizon.raw_from_corrected(behind)).all()


def test_its_matrix_has_the_determinant_that_makes_it_unique():
    for model in (
        *plain_examples("homography"),
        HomographyFitter.fit(clicks(TILTED), FIELD, FULL, SIZE).model,
    ):
        assert np.linalg.det(np.array(model.field_from_raw)) == pytest.approx(-1, abs=1e-9)


def test_a_fit_that_starts_at_its_own_answer_stays_there():
    first = HomographyFitter.fit(clicks(TILTED), FIELD, FULL, SIZE)
    again = HomographyFitter.fit(
        clicks(TILTED), FIELD, FULL, SIZE, {"start": parameters_json(first.model), "robust": False}
    )
    assert carpet_error_mm(again.model, first.model).max() < 1e-3
    assert first.notes["choices"]["start"] == parameters_json(first.model)


def test_field_lines_that_err_are_found_when_they_may():
    """The halfway line painted 20 mm aside, among eight others that are right."""
    observations = []
    for name in (
        "left",
        "right",
        "top",
        "bottom",
        "at-x-1",
        "at-x-2",
        "at-x-3",
        "at-y-1",
        "at-y-3",
    ):
        line = FIELD.feature(name, FULL)
        aside = np.array([20.0, 0.0]) if name == "at-x-2" else 0.0
        observations.append(
            Observation(name, "line", raw_from_field(TILTED, line.sample(9) + aside))
        )
    fit = HomographyFitter.fit(tuple(observations), FIELD, FULL, SIZE, {"line_sigma_mm": 10.0})
    offsets = fit.notes["line_offsets_mm"]
    assert max(offsets, key=lambda name: abs(offsets[name])) == "at-x-2"
    assert 14 < abs(offsets["at-x-2"]) < 20


def test_a_picture_that_falls_onto_one_line_is_no_view_of_a_field():
    """Random clicks on spots that all lie on one line but for one: the best answer of the equations has no inverse."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        counts = {"mark-3-0": 1, "mark-2-4": 1, "mark-2-0": 4, "at-y-1": 5}
        observations = tuple(
            Observation(name, "line", rng.uniform([0, 0], [1279, 1023], (n, 2)))
            for name, n in counts.items()
        )
        with pytest.raises(FitFailed):
            HomographyFitter.fit(observations, FIELD, FULL, SIZE)
