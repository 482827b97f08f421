"""The thin-plate spline: least bending through what clicks tell, and never a folded picture."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support import point_sets
from tests.support.examples import example_parameters, plain_examples
from tests.support.fields import FULL, jittered, marks_seen, plain_field, seen
from tests.support.tiers import long, rounds
from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation, observations_from_json
from touchline.evaluate.fit.comparison import parameter_count
from touchline.evaluate.fit.observability import observability_warnings
from touchline.evaluate.fit.uncertainty import expected_error, grid_over
from touchline.fitting import FITTERS, sensitivity_of
from touchline.fitting.thin_plate.fit import ThinPlateFitter
from touchline.fitting.thin_plate.smoothing import Constraints, SmoothingSplines
from touchline.fitting.thin_plate.uncertainty import NODE_NAMES, lattice
from touchline.models import RayModel, field_from_raw, parameters_json, raw_from_field
from touchline.models.homography import Homography
from touchline.models.lens_models import BrownConrady
from touchline.models.thin_plate import ThinPlate
from touchline.models.thin_plate_spline import Spline
from touchline.workflows import calibration

SIZE = ImageSize(1280, 1024)
FIELD = plain_field()
DOWN, TILTED, _ = (BrownConrady(lens_terms=(-0.28, 0.09, 0, 0, 0, 0, 0, 0), **common)
                   for common in example_parameters())
MILD = BrownConrady(lens_terms=(-0.04, 0, 0, 0, 0, 0, 0, 0), **next(example_parameters()))
PINHOLE = plain_examples("homography")[1]
INSIDE = ("at-x-1", "at-x-2", "at-x-3", "at-y-1", "at-y-2", "at-y-3")


def clicks(model, seed=0, noise_px=0.3, inside=INSIDE, marks=False):
    rng = np.random.default_rng(seed)
    lines = tuple(Observation(name, "line", jittered(raw_from_field(model, FIELD.feature(name, FULL).sample(7)),
                                                     noise_px, rng)) for name in inside)
    spots = marks_seen(model, FIELD, noise_px=noise_px, rng=rng) if marks else ()
    return (*seen(model, FULL, 9, noise_px=noise_px, rng=rng), *lines, *spots)


def rms_mm(model, truth):
    places = np.stack(np.meshgrid(np.linspace(-1900, 1900, 15), np.linspace(-1400, 1400, 11)), axis=-1)
    return float(np.sqrt(np.mean(np.sum((field_from_raw(model, raw_from_field(truth, places)) - places) ** 2, -1))))


def fitted(truth, seed=0, model_class=ThinPlate, inside=INSIDE, marks=False):
    """The fit to the clicks of a seed, without options: one for all tests of this file."""
    return fitted_once(truth, seed, model_class, inside, marks)


@cache
def fitted_once(truth, seed, model_class, inside, marks):
    return FITTERS[model_class.NAME].fit(clicks(truth, seed, inside=inside, marks=marks), FIELD, FULL, SIZE)


def median_rms_mm(model_class, truth, seeds, **how):
    return np.median([rms_mm(fitted(truth, seed, model_class, **how).model, truth) for seed in range(seeds)])


@rounds("seeds", 1, 5)
def test_where_clicks_are_it_takes_a_strong_lens_out_of_a_homography(seeds):
    """Medians of 5 seeds; a homography leaves 39 mm here, six lines inside the field make 10, landmarks as well 3."""
    assert median_rms_mm(Homography, TILTED, seeds=seeds) > 30
    assert median_rms_mm(ThinPlate, TILTED, seeds=seeds) < 12
    assert median_rms_mm(ThinPlate, TILTED, seeds=seeds, marks=True) < 3.5


@rounds("seeds", 1, 5)
def test_borders_alone_tell_it_nothing_of_the_inside(seeds):
    assert median_rms_mm(ThinPlate, TILTED, seeds=seeds, inside=()) > 25  # mm; what the manual says it cannot see


@rounds("seeds", 1, 5)
def test_it_bends_little_where_nothing_is_bent(seeds):
    """A pinhole and noise only: hardly more parameters than a plane's six, and hardly a worse map."""
    fit = fitted(PINHOLE)
    assert fit.notes["smoothing"]["effective_parameters"] < 12
    assert median_rms_mm(ThinPlate, PINHOLE, seeds=seeds) < 1.4 * median_rms_mm(Homography, PINHOLE, seeds=seeds)


def test_a_lens_underneath_leaves_it_nothing_to_do():
    fit = ThinPlateFitter.fit(clicks(DOWN), FIELD, FULL, SIZE, {"base": "brown-conrady"})
    assert fit.model.base.NAME == "brown-conrady"
    assert fit.notes["smoothing"]["effective_parameters"] < 12
    assert rms_mm(fit.model, DOWN) < 1.5


@rounds("seeds", 1, 5)
def test_the_noise_is_read_off_the_residuals(seeds):
    """Under a mild lens; what a spline cannot follow of a strong one counts as noise."""
    told = [fitted(MILD, seed, marks=True).notes["click_sigma_px"]
            for seed in range(seeds)]
    assert np.median(told) == pytest.approx(0.3, rel=0.2)


@pytest.mark.parametrize("far_px", [10.0, 80.0])
def test_strays_are_named_and_left_out(far_px):
    observations = list(clicks(TILTED, marks=True))
    for i, k in ((0, 4), (7, 3)):
        spoilt = observations[i].points.copy()
        spoilt[k] += far_px / np.sqrt(2)
        observations[i] = replace(observations[i], points=spoilt)
    fit = ThinPlateFitter.fit(tuple(observations), FIELD, FULL, SIZE)
    assert [(w.reason, w.feature, w.index) for w in fit.warnings] == [("stray-click", "left", 4),
                                                                      ("stray-click", "at-y-1", 3)]
    assert rms_mm(fit.model, TILTED) < 4


@rounds("seeds", 1, 6)
def test_honest_clicks_are_no_strays(seeds):
    for seed in range(seeds):
        for truth in (DOWN, PINHOLE):
            fit = fitted(truth, seed)
            assert all(fine.all() for fine in fit.inliers)


def test_it_is_the_classical_spline_where_whole_displacements_are_known():
    """Bookstein's (n + 3) equations, solved as he wrote them."""
    rng = np.random.default_rng(2)
    places, values = rng.uniform(-1, 1, (14, 2)), rng.normal(0, 5, (14, 2))
    radius = np.linalg.norm(places[:, None] - places, axis=-1)
    kernel = radius**2 * np.log(np.where(radius > 0, radius, 1))
    plane = np.concatenate([np.ones((14, 1)), places], axis=1)
    system = np.block([[kernel, plane], [plane.T, np.zeros((3, 3))]])
    solution = np.linalg.solve(system, np.concatenate([values, np.zeros((3, 2))]))
    known = Constraints(np.repeat(places, 2, axis=0), np.tile(np.eye(2), (14, 1)), values.ravel(), np.ones(28))
    spline = SmoothingSplines(known).spline(0.0)
    asked = rng.uniform(-1, 1, (50, 2))
    far = np.linalg.norm(asked[:, None] - places, axis=-1)
    expected = far**2 * np.log(far) @ solution[:14] + np.concatenate([np.ones((50, 1)), asked], axis=1) @ solution[14:]
    np.testing.assert_allclose(spline(asked), expected, atol=1e-8)


def test_its_left_out_errors_are_those_of_leaving_out():
    rng = np.random.default_rng(3)
    places, turn = rng.uniform(-1, 1, (30, 2)), rng.uniform(0, np.pi, 30)
    known = Constraints(places, np.stack([np.cos(turn), np.sin(turn)], axis=1), rng.normal(0, 3, 30),
                      rng.uniform(0.5, 2, 30))
    smoother = SmoothingSplines(known)
    quick = smoother.residuals(1e-3) / smoother.free_share(1e-3)
    for j in range(0, 30, 7):
        rest = np.arange(30) != j
        without = SmoothingSplines(Constraints(*(getattr(known, f)[rest]
                                                 for f in ("places", "directions", "values", "weights"))))
        spline = without.spline(1e-3 * smoother.unit / without.unit)
        error = (known.values[j] - known.directions[j] @ spline(places[j:j + 1])[0]) * known.weights[j]
        assert error == pytest.approx(quick[j], abs=1e-8)


def test_its_knots_stand_in_the_order_of_the_clicks_whatever_the_last_digit_of_their_places():
    places = np.array([(x, y) for y in (1.0, -1.0, 0.0) for x in (0.5, -0.5, 0.0, 0.9)])
    for jitter in (1e-12, -1e-12):
        level = places + jitter * np.arange(12)[:, None]
        known = Constraints(np.repeat(level, 2, axis=0), np.tile(np.eye(2), (12, 1)), np.arange(24.0), np.ones(24))
        np.testing.assert_allclose(SmoothingSplines(known).spline(1e-3).knots, places, atol=1e-9)


def test_the_gradient_is_that_of_the_displacement():
    rng = np.random.default_rng(4)
    spline = Spline(rng.uniform(-1, 1, (9, 2)), rng.normal(0, 3, (9, 2)), rng.normal(0, 1, (3, 2)))
    places, step = rng.uniform(-1, 1, (20, 2)), 1e-6
    slope = spline.with_gradient(places)[1]
    for axis in range(2):
        ahead, behind = (spline(places + s * np.eye(2)[axis]) for s in (step, -step))
        np.testing.assert_allclose(slope[:, :, axis], (ahead - behind) / (2 * step), atol=1e-6)


def test_there_and_back_holds_up_to_the_edge_of_its_reach_and_beyond_is_nothing():
    model = fitted(TILTED, marks=True).model
    half = np.array([model.width_px, model.height_px]) * (0.5 + model.reach)
    rng = np.random.default_rng(5)
    near = half * (rng.uniform(-0.999, 0.999, (500, 2))) + np.array([model.width_px, model.height_px]) / 2
    raw = model.raw_from_corrected(near)
    seen_there = np.isfinite(raw).all(axis=1)
    assert seen_there.mean() > 0.9
    np.testing.assert_allclose(model.corrected_from_raw(raw[seen_there]), near[seen_there], atol=1e-6)
    assert np.isnan(model.raw_from_corrected(half * 2.1)).all()
    edge = np.array([[model.width_px / 2 - half[0] - 0.5, model.height_px / 2]])  # half a pixel past it
    bend = model._spline(np.array([[-1 - 2 * model.reach, 0.0]]))
    assert np.isnan(model.corrected_from_raw(model.base.raw_from_corrected(edge + bend))).all()
    beyond = model.base.raw_from_corrected(np.array([model.width_px / 2, model.height_px + 2 * half[1]]))
    assert np.isfinite(beyond).all() and np.isnan(model.corrected_from_raw(beyond)).all()


def test_a_spline_that_folds_the_picture_is_refused():
    observations = list(clicks(PINHOLE, marks=True))
    first, second = 10 + 12, 10 + 13  # two neighbouring landmarks, mixed up
    observations[first], observations[second] = (replace(observations[first], points=observations[second].points),
                                                 replace(observations[second], points=observations[first].points))
    with pytest.raises(FitFailed) as refusal:
        ThinPlateFitter.fit(tuple(observations), FIELD, FULL, SIZE, {"smoothing": 0.0, "robust": False})
    assert refusal.value.reason == "folds"


def test_a_file_that_folds_the_picture_is_refused():
    parameters = parameters_json(fitted(DOWN).model)
    parameters["weights"][0] = [4000.0, 0.0]
    with pytest.raises(BadInput, match="folds") as refusal:
        ThinPlate.from_parameters(parameters)
    assert refusal.value.reason == "bad-parameters"


@rounds("each", 70, 400)
def test_more_points_than_knots_are_thinned_and_still_quick(each):
    rng = np.random.default_rng(6)
    names = ("left", "right", "top", "bottom", *INSIDE)
    many = tuple(Observation(name, "line", jittered(raw_from_field(DOWN, FIELD.feature(name, FULL).sample(each)), 0.3,
                                                    rng)) for name in names)
    fit = ThinPlateFitter.fit(many, FIELD, FULL, SIZE)
    assert len(fit.model.knots) <= 400
    assert rms_mm(fit.model, DOWN) < 12


def test_too_little_is_refused_by_name():
    on_one = np.stack([np.linspace(100, 1100, 9), np.linspace(200, 700, 9)], axis=1)
    observations = tuple(Observation(name, "line", on_one) for name in ("left", "right", "top", "bottom"))
    with pytest.raises(FitFailed) as refusal:
        ThinPlateFitter.fit(observations, FIELD, FULL, SIZE)
    assert refusal.value.reason in ("lines-not-enough", "no-camera", "mirrored")


def test_points_above_the_carpet_are_left_out_and_said_so():
    hat = Observation((0.0, 0.0), "landmark", np.array([[640.0, 400.0]]), z_mm=150.0)
    fit = ThinPlateFitter.fit((*clicks(DOWN), hat), FIELD, FULL, SIZE)
    assert [w.reason for w in fit.warnings] == ["above-the-carpet"]
    assert fit.used[-1] is False
    assert not isinstance(fit.model, RayModel)


def test_its_choices_make_the_same_fit_again():
    fit = fitted(TILTED)
    again = ThinPlateFitter.fit(clicks(TILTED), FIELD, FULL, SIZE, {**fit.notes["choices"], "robust": False})
    assert rms_mm(again.model, fit.model) < 1e-2


def test_without_smoothing_it_passes_through_every_click_on_lines_and_arcs():
    observations = clicks(TILTED, noise_px=0.0, inside=("circle", *INSIDE))
    model = ThinPlateFitter.fit(observations, FIELD, FULL, SIZE, {"smoothing": 0.0, "robust": False}).model
    for o in observations:
        place = field_from_raw(model, o.points)
        np.testing.assert_allclose(place, FIELD.feature(o.feature, FULL).nearest(place), atol=1e-5)


def test_a_click_on_the_very_centre_of_an_arc_is_no_end_of_the_world():
    centre = Observation("circle", "line", raw_from_field(PINHOLE, np.array([[0.0, 0.0]])))
    fit = ThinPlateFitter.fit((*clicks(PINHOLE), centre), FIELD, FULL, SIZE)
    assert [(w.reason, w.feature) for w in fit.warnings] == [("stray-click", "circle")]


def spread_and_told_mm(truth, options, seeds, **how):
    """Over the field: how far repeated clicking scatters, how far it is off, and what the fits expect of each."""
    import touchline.fitting.thin_plate.fit as module
    whole, noise = module._covariance, []
    places = grid_over(FULL, 9, 7)
    with pytest.MonkeyPatch.context() as patch:  # to listen in: the noise's part alone is no part of a fit
        patch.setattr(module, "_covariance", lambda base, some, settled, _: (
            noise.append(whole(base, some, settled, 0.3, unseen=False)), whole(base, some, settled, None))[1])
        fits = [ThinPlateFitter.fit(clicks(truth, seed, **how), FIELD, FULL, SIZE, options) for seed in range(seeds)]
    off = np.array([field_from_raw(f.model, raw_from_field(truth, places)) - places for f in fits])

    def told(some):
        return np.sqrt(np.mean([expected_error(f, FULL, 0.0, places).sigma_mm ** 2 for f in some]))
    return (np.sqrt(off.var(axis=0, ddof=1).sum(-1).mean()), np.sqrt((off**2).sum(-1).mean()),
            told([replace(f, covariance=c) for f, c in zip(fits, noise, strict=True)]), told(fits))


@pytest.mark.parametrize("truth, how, seeds, within", [
    (MILD, {}, 8, 0.3),  # so few tell the scatter of some ten numbers to 10 %
    long(PINHOLE, {"inside": ()}, 60, 0.15), long(MILD, {}, 50, 0.15), long(TILTED, {"marks": True}, 25, 0.15)])
def test_repeated_clicking_scatters_as_the_hat_matrix_says(truth, how, seeds, within):
    """The base's own error from the same clicks included, without what clicks cannot tell."""
    spread, _, noise, _ = spread_and_told_mm(truth, None, seeds, **how)
    assert spread == pytest.approx(noise, rel=within)


@rounds("seeds", 3, 12)
def test_its_expected_error_is_near_the_observed_one_and_counts_what_no_click_tells(seeds):
    """Under a mild lens: 1.4 mm where landmarks are, 5 mm from borders alone, which scatter by 1 mm only."""
    _, off, _, told = spread_and_told_mm(MILD, None, seeds, marks=True)
    assert off == pytest.approx(told, rel=0.35)
    spread, off, _, told = spread_and_told_mm(MILD, None, seeds, inside=())
    assert told > 2.5 * spread and off == pytest.approx(told, rel=0.5)


@rounds("seeds", 2, 12)
def test_a_spline_through_every_click_still_knows_its_error(seeds):
    """It leaves no residual to read the noise off; the likely smoothing's is taken."""
    _, off, _, told = spread_and_told_mm(MILD, {"smoothing": 1e-4}, seeds, marks=True)
    assert off == pytest.approx(told, rel=0.25)


def test_its_expected_error_travels_with_its_report_and_is_ranked_by_the_numbers_it_found():
    made = calibration.calibrate(clicks(MILD, marks=True), FIELD, FULL, SIZE, "thin-plate", cross_validate=False)
    kept = made.report["covariance"]
    assert kept["names"] == list(NODE_NAMES) and len(kept["matrix"]) == 2 * len(lattice(1.0, 1.0))
    over = calibration.uncertainty(made.model, kept, FULL)
    assert over["rms"] == pytest.approx(made.report["sigma_mm"]["rms"], rel=0.1)
    assert parameter_count(made.fit) == made.fit.notes["parameters"] != len(NODE_NAMES)


def test_borders_alone_are_told_to_be_a_guess_and_the_next_click_is_inside():
    made = calibration.calibrate(clicks(TILTED, inside=()), FIELD, FULL, SIZE, "thin-plate")
    assert made.report["verdict"]["level"] == "poor"  # a lens on the same points bends the inside otherwise
    (said,) = observability_warnings(made.fit, FULL)
    assert "distortion between" in said.text and "robot-top height" not in said.text
    following = made.report["next_click"]
    assert following["feature"].startswith("at-") or following["feature"] == "circle"
    assert following["worst_mm_then"] < 0.9 * following["worst_mm"]


def test_the_errors_derivatives_are_those_of_the_map():
    """A displacement that the lattice can carry, added to the model: the place and the click move as told."""
    fit = fitted(MILD)
    bump = np.random.default_rng(1).normal(0, 1, len(NODE_NAMES))
    places = np.array([[0.0, 0.0], [-1500.0, 900.0], [700.0, -1200.0]])
    xyz = np.concatenate([places, np.zeros((3, 1))], axis=1)
    moved = sensitivity_of(fit.model).field_jacobian(xyz, NODE_NAMES) @ bump
    nodes = fit.model.field_from_corrected(lattice(fit.model.width_px, fit.model.height_px))
    mm_per_px = fit.model.field_from_corrected(np.eye(2)) - fit.model.field_from_corrected(np.zeros((2, 2)))
    at_nodes = sensitivity_of(fit.model).field_jacobian(np.concatenate([nodes, np.zeros((35, 1))], axis=1),
                                                        NODE_NAMES) @ bump
    np.testing.assert_allclose(at_nodes, bump.reshape(-1, 2) @ mm_per_px, atol=1e-9)
    along = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    px = sensitivity_of(fit.model).click_jacobian(places, along, NODE_NAMES) @ bump
    image, ahead = (raw_from_field(fit.model, places - moved * s) for s in (0.0, 1e-3))
    run = raw_from_field(fit.model, places + along) - image
    across = np.stack([-run[:, 1], run[:, 0]], axis=1) / np.linalg.norm(run, axis=1, keepdims=True)
    np.testing.assert_allclose(px, np.einsum("ni,ni->n", across, ahead - image) / 1e-3, rtol=0.02)
    assert np.isnan(sensitivity_of(fit.model).field_jacobian(np.array([[9e4, 0.0, 0.0]]), NODE_NAMES)).all()


@pytest.mark.parametrize("name", ["two points a border", "every feature twice"])
def test_the_covariance_of_nearly_exact_points_is_a_covariance_once_it_is_rounded(name):
    view = point_sets.View("half", 90)
    observations = observations_from_json(point_sets.SETS[name](view))
    made = calibration.calibrate(observations, point_sets.FIELD, view.region, point_sets.SIZE, "thin-plate",
                                 cross_validate=False)
    assert 0 < calibration.uncertainty(made.model, made.report["covariance"], view.region)["rms"] < 3
