"""The thin-plate spline: least bending through what clicks tell, and never a folded picture."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import FULL, jittered, marks_seen, plain_field, seen

from app.errors import BadInput, FitFailed
from app.geometry import ImageSize
from app.models import field_from_raw, parameters_json, raw_from_field
from app.models.brown_conrady import BrownConrady
from app.models.homography import Homography
from app.models.rays import example_fields
from app.models.spline import Knowledge, Smoother, Spline
from app.models.thin_plate import ThinPlate
from app.records import Observation

SIZE = ImageSize(1280, 1024)
FIELD = plain_field()
DOWN, TILTED, _ = (BrownConrady(lens_terms=(-0.28, 0.09, 0, 0, 0, 0, 0, 0), **common) for common in example_fields())
MILD = BrownConrady(lens_terms=(-0.04, 0, 0, 0, 0, 0, 0, 0), **next(example_fields()))
PINHOLE = list(Homography.examples())[1]
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


def median_rms_mm(model_class, truth, options=None, **how):
    return np.median([rms_mm(model_class.fit(clicks(truth, seed, **how), FIELD, FULL, SIZE, options).model, truth)
                      for seed in range(5)])


def test_where_clicks_are_it_takes_a_strong_lens_out_of_a_homography():
    """Medians of 5 seeds; a homography leaves 39 mm here, six lines inside the field make 10, landmarks as well 3."""
    assert median_rms_mm(Homography, TILTED) > 30
    assert median_rms_mm(ThinPlate, TILTED) < 12
    assert median_rms_mm(ThinPlate, TILTED, marks=True) < 3.5


def test_borders_alone_tell_it_nothing_of_the_inside():
    assert median_rms_mm(ThinPlate, TILTED, inside=()) > 25  # mm; what the manual says it cannot see


def test_it_bends_little_where_nothing_is_bent():
    """A pinhole and noise only: hardly more parameters than a plane's six, and hardly a worse map."""
    fit = ThinPlate.fit(clicks(PINHOLE), FIELD, FULL, SIZE)
    assert fit.notes["smoothing"]["effective_parameters"] < 12
    assert median_rms_mm(ThinPlate, PINHOLE) < 1.4 * median_rms_mm(Homography, PINHOLE)


def test_a_lens_underneath_leaves_it_nothing_to_do():
    fit = ThinPlate.fit(clicks(DOWN), FIELD, FULL, SIZE, {"base": "brown-conrady"})
    assert fit.model.base.NAME == "brown-conrady"
    assert fit.notes["smoothing"]["effective_parameters"] < 12
    assert rms_mm(fit.model, DOWN) < 1.5


def test_the_noise_is_read_off_the_residuals():
    """Under a mild lens; what a spline cannot follow of a strong one counts as noise."""
    told = [ThinPlate.fit(clicks(MILD, seed, marks=True), FIELD, FULL, SIZE).notes["click_sigma_px"]
            for seed in range(5)]
    assert np.median(told) == pytest.approx(0.3, rel=0.2)


@pytest.mark.parametrize("far_px", [10.0, 80.0])
def test_strays_are_named_and_left_out(far_px):
    observations = list(clicks(TILTED, marks=True))
    for i, k in ((0, 4), (7, 3)):
        spoilt = observations[i].points.copy()
        spoilt[k] += far_px / np.sqrt(2)
        observations[i] = replace(observations[i], points=spoilt)
    fit = ThinPlate.fit(tuple(observations), FIELD, FULL, SIZE)
    assert [(w.reason, w.feature, w.index) for w in fit.warnings] == [("stray-click", "left", 4),
                                                                      ("stray-click", "at-y-1", 3)]
    assert rms_mm(fit.model, TILTED) < 4


def test_honest_clicks_are_no_strays():
    for seed in range(6):
        for truth in (DOWN, PINHOLE):
            fit = ThinPlate.fit(clicks(truth, seed), FIELD, FULL, SIZE)
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
    known = Knowledge(np.repeat(places, 2, axis=0), np.tile(np.eye(2), (14, 1)), values.ravel(), np.ones(28))
    spline = Smoother(known).spline(0.0)
    asked = rng.uniform(-1, 1, (50, 2))
    far = np.linalg.norm(asked[:, None] - places, axis=-1)
    expected = far**2 * np.log(far) @ solution[:14] + np.concatenate([np.ones((50, 1)), asked], axis=1) @ solution[14:]
    np.testing.assert_allclose(spline(asked), expected, atol=1e-8)


def test_its_left_out_errors_are_those_of_leaving_out():
    rng = np.random.default_rng(3)
    places, turn = rng.uniform(-1, 1, (30, 2)), rng.uniform(0, np.pi, 30)
    known = Knowledge(places, np.stack([np.cos(turn), np.sin(turn)], axis=1), rng.normal(0, 3, 30),
                      rng.uniform(0.5, 2, 30))
    smoother = Smoother(known)
    quick = smoother.residuals(1e-3) / smoother.leeway(1e-3)
    for j in range(0, 30, 7):
        rest = np.arange(30) != j
        without = Smoother(Knowledge(*(getattr(known, f)[rest] for f in ("places", "directions", "values", "weights"))))
        spline = without.spline(1e-3 * smoother.unit / without.unit)
        error = (known.values[j] - known.directions[j] @ spline(places[j:j + 1])[0]) * known.weights[j]
        assert error == pytest.approx(quick[j], abs=1e-8)


def test_the_gradient_is_that_of_the_displacement():
    rng = np.random.default_rng(4)
    spline = Spline(rng.uniform(-1, 1, (9, 2)), rng.normal(0, 3, (9, 2)), rng.normal(0, 1, (3, 2)))
    places, step = rng.uniform(-1, 1, (20, 2)), 1e-6
    slope = spline.with_gradient(places)[1]
    for axis in range(2):
        ahead, behind = (spline(places + s * np.eye(2)[axis]) for s in (step, -step))
        np.testing.assert_allclose(slope[:, :, axis], (ahead - behind) / (2 * step), atol=1e-6)


def test_there_and_back_holds_up_to_the_edge_of_its_reach_and_beyond_is_nothing():
    model = ThinPlate.fit(clicks(TILTED, marks=True), FIELD, FULL, SIZE).model
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
        ThinPlate.fit(tuple(observations), FIELD, FULL, SIZE, {"smoothing": 0.0, "robust": False})
    assert refusal.value.reason == "folds"


def test_a_file_that_folds_the_picture_is_refused():
    parameters = parameters_json(ThinPlate.fit(clicks(DOWN), FIELD, FULL, SIZE).model)
    parameters["weights"][0] = [4000.0, 0.0]
    with pytest.raises(BadInput, match="folds") as refusal:
        ThinPlate.from_parameters(parameters)
    assert refusal.value.reason == "bad-parameters"


def test_thousands_of_points_are_thinned_and_still_quick():
    rng = np.random.default_rng(6)
    names = ("left", "right", "top", "bottom", *INSIDE)
    many = tuple(Observation(name, "line", jittered(raw_from_field(DOWN, FIELD.feature(name, FULL).sample(400)), 0.3,
                                                    rng)) for name in names)
    fit = ThinPlate.fit(many, FIELD, FULL, SIZE)
    assert len(fit.model.knots) <= 400
    assert rms_mm(fit.model, DOWN) < 12


def test_too_little_is_refused_by_name():
    on_one = np.stack([np.linspace(100, 1100, 9), np.linspace(200, 700, 9)], axis=1)
    observations = tuple(Observation(name, "line", on_one) for name in ("left", "right", "top", "bottom"))
    with pytest.raises(FitFailed) as refusal:
        ThinPlate.fit(observations, FIELD, FULL, SIZE)
    assert refusal.value.reason in ("lines-not-enough", "no-camera", "mirrored")


def test_points_above_the_carpet_are_left_out_and_said_so():
    hat = Observation((0.0, 0.0), "landmark", np.array([[640.0, 400.0]]), z_mm=150.0)
    fit = ThinPlate.fit((*clicks(DOWN), hat), FIELD, FULL, SIZE)
    assert [w.reason for w in fit.warnings] == ["above-the-carpet"]
    assert fit.used[-1] is False
    assert not hasattr(fit.model, "project")


def test_its_choices_make_the_same_fit_again():
    fit = ThinPlate.fit(clicks(TILTED), FIELD, FULL, SIZE)
    again = ThinPlate.fit(clicks(TILTED), FIELD, FULL, SIZE, {**fit.notes["choices"], "robust": False})
    assert rms_mm(again.model, fit.model) < 1e-2


def test_without_smoothing_it_passes_through_every_click_on_lines_and_arcs():
    observations = clicks(TILTED, noise_px=0.0, inside=("circle", *INSIDE))
    model = ThinPlate.fit(observations, FIELD, FULL, SIZE, {"smoothing": 0.0, "robust": False}).model
    for o in observations:
        place = field_from_raw(model, o.points)
        np.testing.assert_allclose(place, FIELD.feature(o.feature, FULL).nearest(place), atol=1e-5)


def test_a_click_on_the_very_centre_of_an_arc_is_no_end_of_the_world():
    centre = Observation("circle", "line", raw_from_field(PINHOLE, np.array([[0.0, 0.0]])))
    fit = ThinPlate.fit((*clicks(PINHOLE), centre), FIELD, FULL, SIZE)
    assert [(w.reason, w.feature) for w in fit.warnings] == [("stray-click", "circle")]
