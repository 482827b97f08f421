"""Cameras with rays from an operator's clicks: millimetres, strays, priors, heights, and honest refusals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.auto_scenes import fields
from tests.support.fields import plain_field
from tests.support.operator import (
    FIELD,
    REGION,
    SIZE,
    carpet_and_hat_mm,
    fitted,
    reference_camera,
    true_camera,
)
from tests.support.sim_clicks import border_observations, known_grid, landmark_observations, rms_mm
from tests.support.tiers import long, rounds
from touchline.core.errors import BadInput, FitFailed, TouchlineError
from touchline.core.field import BORDERS, ROBOT_TOP_MM, Arc, Field
from touchline.core.geometry import ImageSize
from touchline.core.options import read_options
from touchline.core.records import Observation
from touchline.evaluate.next_click import observability_warnings, weakest_direction
from touchline.evaluate.uncertainty import expected_error
from touchline.fitting import FITTERS
from touchline.fitting.ray_camera.camera_prior import camera_priors, unusual_camera_warnings
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import MODELS, RayModel, field_from_raw, parameters_json
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.workflows import calibration, model_choice

RAYS = [name for name in MODELS if issubclass(MODELS[name], RayModel)]
SEEDS = range(8)


CENTRED = {"centre_sigma_px": 0.0, "aspect_sigma": 0.0}  # a camera whose principal point is known


@pytest.mark.parametrize("tilt", [long(0), 8, long(15)])
@pytest.mark.parametrize(
    ("known", "limit_mm"), [(CENTRED, 2.8), ({}, 4.6)], ids=["centred", "as cameras are"]
)
def test_36_clicks_anywhere_along_four_borders_reach_millimetres(known, limit_mm, tilt):
    """Median of 8 seeds; to beat: 25 to 38 mm (boundary polynomials), 46 to 68 mm (homography)."""
    camera = reference_camera("strong", tilt)
    carpet, hat = np.median(
        [carpet_and_hat_mm(fitted(camera, seed, **known), camera) for seed in SEEDS], axis=0
    )
    assert carpet <= limit_mm and hat <= limit_mm + 0.4


def test_known_positions_along_the_border_reach_more():
    camera, errors = reference_camera("strong", 8), []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        t = np.linspace(0, 1, 10)[:9, None]
        raw, field = [], []
        for line in (REGION.border(name) for name in ("left", "right", "top", "bottom")):
            places = np.array(line.start) * (1 - t) + np.array(line.end) * t
            raw.append(camera.raw_from_field(places))
            field.append(places)
        spots = landmark_observations(np.concatenate(raw), np.concatenate(field), 0.3, rng)
        model = (
            FITTERS["brown-conrady"]
            .fit(
                spots,
                FIELD,
                REGION,
                SIZE,
                {
                    "terms": ["k1", "k2"],
                    "height_mm": {"value": camera.position_mm[2], "sigma": 30.0},
                },
            )
            .model
        )
        grid, truth = known_grid(camera, REGION, 21, 17)
        errors.append(rms_mm(field_from_raw(model, grid), truth))
    assert np.median(errors) <= 1.6


def test_hat_height_needs_a_tape_from_straight_above():
    camera = reference_camera("mild", 0)
    errors = [
        carpet_and_hat_mm(fitted(camera, seed, noise_px=0.5, **CENTRED), camera)[1]
        for seed in SEEDS
    ]
    assert np.mean(errors) <= 2.6  # worlds of 36 clicks; 2 mm with 60, see the benchmark


@pytest.mark.parametrize("lens", ["none", "mild", "strong", "pincushion"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_straight_down_without_a_height_there_is_always_a_warning(lens, seed):
    fit = fitted(reference_camera(lens, 0), seed, tape=False)
    warnings = observability_warnings(fit, REGION)
    assert [w.reason for w in warnings] == ["height-unknown"]
    assert "enter the camera height" in warnings[0].fix and "mm" in warnings[0].fix
    weak = weakest_direction(fit, REGION)
    assert {"focal length", "height"} <= set(weak.parts)
    assert weak.taped_robot_top_mm < 7 < 14 < weak.robot_top_mm


def test_with_the_height_taped_there_is_none():
    assert observability_warnings(fitted(reference_camera("strong", 0), 0), REGION) == []


def test_points_at_a_known_height_cure_it_too():
    camera = reference_camera("strong", 0)
    tops = [
        Observation(
            (x, y), "landmark", [camera.raw_from_field(np.array([x, y, 150.0]))], z_mm=150.0
        )
        for x in (-1500.0, 1500.0)
        for y in (-1000.0, 1000.0)
    ]
    without, with_tops = (fitted(camera, 3, tape=False, extra=e) for e in ((), tuple(tops)))
    assert (
        expected_error(with_tops, REGION, ROBOT_TOP_MM).rms
        < 0.2 * expected_error(without, REGION, ROBOT_TOP_MM).rms
    )
    assert carpet_and_hat_mm(with_tops, camera)[1] < 4


@pytest.mark.parametrize("model", RAYS)
def test_arcs_landmarks_and_lines_mix_freely(model):
    camera = reference_camera("division" if model == "division" else "half", 10)
    field = Field(
        "marked",
        "Marked",
        4000.0,
        3000.0,
        plain_field().lines,
        {"circle": Arc("circle", (0.0, 0.0), 500.0)},
        plain_field().landmarks,
        {"full": REGION},
    )
    rng = np.random.default_rng(1)
    round_, straight = (
        camera.raw_from_field(shape.sample(13)) + rng.normal(0, 0.3, (13, 2))
        for shape in (field.arcs["circle"], field.lines["at-x-1"])
    )
    circle, line = Observation("circle", "line", round_), Observation("at-x-1", "line", straight)
    spot = Observation(
        "mark-1-3",
        "landmark",
        camera.raw_from_field(np.array([field.landmarks["mark-1-3"].position])),
    )
    borders = border_observations(camera, REGION, 6, 0.3, rng, anywhere=True)
    fit = FITTERS[model].fit((*borders, circle, line, spot), field, REGION, SIZE)
    raw, truth = known_grid(camera, REGION, 11, 9)
    assert rms_mm(field_from_raw(fit.model, raw), truth) < (12 if model == "ssl" else 4)
    assert all(fit.used)


@pytest.mark.parametrize("model", RAYS)
@pytest.mark.parametrize("border", ["left", "bottom"])
def test_a_stray_click_is_named_and_changes_next_to_nothing(model, border):
    camera = reference_camera("half", 8)
    observations = border_observations(
        camera, REGION, 9, 0.3, np.random.default_rng(5), anywhere=True
    )
    off = (
        np.array([[25.0, 0.0]] if border == "left" else [[0.0, 25.0]])
        * (np.arange(9) == 4)[:, None]
    )
    spoilt = tuple(
        replace(o, points=o.points + off) if o.feature == border else o for o in observations
    )
    fit = FITTERS[model].fit(spoilt, FIELD, REGION, SIZE)
    assert [(w.reason, w.feature, w.index) for w in fit.warnings] == [("stray-click", border, 4)]
    clean = FITTERS[model].fit(observations, FIELD, REGION, SIZE)
    raw, _ = known_grid(camera, REGION, 9, 7)
    assert rms_mm(field_from_raw(fit.model, raw), field_from_raw(clean.model, raw)) < 3


def test_lines_painted_beside_their_places_are_found():
    """20 mm of error in a taped line: held exact it spoils the fit; otherwise its own offset is found and reported."""
    camera = reference_camera("strong", 12)
    field = plain_field()
    moved = replace(field.lines["at-x-2"], start=(20.0, -1500.0), end=(20.0, 1500.0))
    rng = np.random.default_rng(0)
    lines = [moved if line.name == "at-x-2" else line for line in field.lines.values()]
    seen = tuple(
        Observation(
            line.name, "line", camera.raw_from_field(line.sample(7)) + rng.normal(0, 0.3, (7, 2))
        )
        for line in lines
    )
    borders = border_observations(camera, REGION, 9, 0.3, rng)
    raw, truth = known_grid(camera, REGION, 11, 9)
    errors = []
    for believed in (field, replace(field, line_sigma_mm=3.0)):  # exact; painted as fields are
        fit = FITTERS["brown-conrady"].fit(
            (*borders, *seen), believed, REGION, SIZE, {"robust": False}
        )
        errors.append(rms_mm(field_from_raw(fit.model, raw), truth))
    offsets = fit.notes["line_offsets_mm"]
    assert abs(offsets["at-x-2"]) == pytest.approx(20, abs=4)
    assert max(abs(v) for k, v in offsets.items() if k != "at-x-2") < 5
    assert errors[1] < errors[0]


def test_an_arc_painted_about_another_centre_does_not_move_the_field():
    """A circle 12 mm off to one side and 8 mm to the other: held at its place it draws the whole camera along."""
    camera = reference_camera("strong", 12)
    circle = Arc("circle", (300.0, 0.0), 500.0)
    rng = np.random.default_rng(0)
    painted = camera.raw_from_field(circle.shifted(0.0, (12.0, -8.0)).sample(60)) + rng.normal(
        0, 0.3, (60, 2)
    )
    seen = (
        *border_observations(camera, REGION, 9, 0.3, rng),
        Observation("circle", "line", painted),
    )
    raw, truth = known_grid(camera, REGION, 11, 9)
    errors, reports = [], []
    for sigma_mm in (0.0, 3.0):  # exact; painted as fields are
        field = replace(FIELD, arcs={"circle": circle}, line_sigma_mm=sigma_mm)
        done = calibration.calibrate(seen, field, REGION, SIZE, "brown-conrady", {"robust": False})
        errors.append(rms_mm(field_from_raw(done.fit.model, raw), truth))
        reports.append(done.report)
    assert reports[0]["arc_offsets_mm"] == {}
    assert reports[1]["arc_offsets_mm"]["circle"] == pytest.approx((12, -8), abs=4.5)
    assert errors[1] < 0.6 * errors[0], errors


@pytest.mark.parametrize(
    ("model", "begin_mm"), [("brown-conrady", 32_000.0), ("division", 16_000.0)]
)
def test_neither_the_camera_nor_how_probable_it_is_depends_on_where_the_search_began(
    model, begin_mm
):
    """A half field 70 mm wider than its definition, from straight above: from far off, a tilt would explain that."""
    field = fields()["ssl-2008"]
    region, size = field.region("half"), ImageSize(780, 580)
    camera = SimCamera.above(
        region, size, LENSES["strong"], height_mm=4000.0, tilt_deg=1.0, pan_deg=0.5
    )
    painted = field.as_painted({"line_offsets_mm": {"left": -35.0, "right": 35.0}}, region)
    rng, seen = np.random.default_rng(1), []
    for name, count in (
        *((border, 40) for border in BORDERS),
        ("centre-circle", 60),
        ("defence-right-arc-top", 9),
        ("defence-right-arc-bottom", 9),
        ("defence-right-front", 5),
    ):
        raw = camera.raw_from_field(painted.feature(name, region).sample(count))
        raw = raw[camera.sees(raw)]
        seen.append(Observation(name, "line", raw + rng.normal(0, 0.25, raw.shape)))

    def fit(**options):
        return FITTERS[model].fit(tuple(seen), field, region, size, options)

    near = fit()
    far = fit(height_mm={"value": begin_mm, "sigma": 30.0}, line_sigma_mm=1.0)
    back = fit(start=parameters_json(far.model))
    assert back.model.position_mm[2] == pytest.approx(near.model.position_mm[2], rel=0.02)
    assert back.notes["log_evidence"] == pytest.approx(near.notes["log_evidence"], abs=1.0)
    assert [w.reason for w in observability_warnings(back, region)] == ["height-unknown"]


def test_a_known_lens_is_held():
    camera = reference_camera("strong", 0)
    known = fitted(reference_camera("strong", 15), 0).model
    lens = {"name": "brown-conrady", "parameters": parameters_json(known)}
    fit = fitted(camera, 1, tape=False, lens=lens)
    assert fit.model.lens_terms == known.lens_terms
    assert fit.model.focal_px == pytest.approx(known.focal_px)
    assert carpet_and_hat_mm(fit, camera)[1] < 8
    with pytest.raises(BadInput, match="division"):
        FITTERS["division"].fit(
            border_observations(camera, REGION, 9), FIELD, REGION, SIZE, {"lens": lens}
        )


@pytest.mark.parametrize(("seeds", "within"), [(12, 0.35), long(60, 0.2)])  # twelve tell it to 15 %
def test_expected_error_is_the_observed_one(seeds, within):
    """Mean square over 60 seeds; the 200-seed figure within 10 % is the benchmark's."""
    camera = reference_camera("strong", 8)
    fits = [fitted(camera, seed, terms=["k1", "k2"]) for seed in range(seeds)]
    observed = np.sqrt(np.mean([np.square(carpet_and_hat_mm(f, camera)) for f in fits], axis=0))
    expected = np.sqrt(
        np.mean(
            [[expected_error(f, REGION, z).rms ** 2 for z in (0.0, ROBOT_TOP_MM)] for f in fits],
            axis=0,
        )
    )
    np.testing.assert_allclose(observed, expected, rtol=within)


@pytest.mark.parametrize("line_sigma_mm", [0.0, 2.0, 6.0])
def test_the_next_best_click_lowers_the_worst_error_as_promised(line_sigma_mm):
    camera = reference_camera("strong", 8)
    known = {"terms": ["k1", "k2"], "click_sigma_px": 0.3, "line_sigma_mm": line_sigma_mm}
    clicks = border_observations(camera, REGION, 9, 0.3, np.random.default_rng(2), anywhere=True)
    told = calibration.calibrate(clicks, FIELD, REGION, SIZE, "brown-conrady", known).report[
        "next_click"
    ]
    assert told["worst_mm_then"] < told["worst_mm"]
    added = Observation(told["feature"], "line", [told["point"]])
    after = FITTERS["brown-conrady"].fit((*clicks, added), FIELD, REGION, SIZE, known)
    assert expected_error(after, REGION, told["z_mm"]).worst[0] == pytest.approx(
        told["worst_mm_then"], rel=0.1
    )


@pytest.mark.parametrize(("seen", "told"), [(0, "circle"), (3, "circle"), (8, "left")])
def test_the_next_best_click_counts_how_lines_and_arcs_may_be_painted(seen, told):
    """Whether on an arc that nobody has clicked, on one whose centre is known a little, or on a line that may tilt."""
    camera, rng = reference_camera("strong", 8), np.random.default_rng(2)
    known = {"terms": ["k1", "k2"], "click_sigma_px": 0.3, "line_sigma_mm": 6.0}
    circle = Arc("circle", (0.0, 0.0), 600.0)
    field = replace(FIELD, lines={}, arcs={"circle": circle})
    borders = border_observations(camera, REGION, 9, 0.3, rng, anywhere=True)
    clicked = camera.raw_from_field(circle.sample(seen + 1)[:seen]) + rng.normal(0, 0.3, (seen, 2))
    clicks = (*borders, Observation("circle", "line", clicked))
    best = calibration.calibrate(clicks, field, REGION, SIZE, "brown-conrady", known).report[
        "next_click"
    ]
    after = FITTERS["brown-conrady"].fit(
        (*clicks, Observation(best["feature"], "line", [best["point"]])), field, REGION, SIZE, known
    )
    assert best["feature"] == told
    assert expected_error(after, REGION, best["z_mm"]).worst[0] == pytest.approx(
        best["worst_mm_then"], rel=0.015
    )


def mirrored(observations):
    return tuple(
        replace(o, points=np.array([[SIZE.width - 1, 0.0]]) + o.points * np.array([[-1.0, 1.0]]))
        for o in observations
    )


@pytest.mark.parametrize("model", RAYS)
@pytest.mark.parametrize(
    "spoil, reason",
    [
        (lambda o: (), "too-few-points"),
        (lambda o: tuple(replace(b, points=b.points[:1]) for b in o), "too-few-points"),
        (lambda o: o[:2], "lines-not-enough"),
        (
            lambda o: tuple(
                replace(b, points=np.tile(np.linspace(300, 600, 9)[:, None], 2)) for b in o
            ),
            None,
        ),
        (lambda o: tuple(replace(b, points=np.full((9, 2), 400.0)) for b in o), None),
        (mirrored, "mirrored"),
        (lambda o: tuple(replace(b, points=b.points + 2000) for b in o), "outside-picture"),
    ],
)
def test_degenerate_clicks_are_refused_by_name(model, spoil, reason):
    observations = spoil(border_observations(reference_camera("half", 8), REGION, 9))
    with pytest.raises(FitFailed) as refusal:
        FITTERS[model].fit(observations, FIELD, REGION, SIZE)
    assert refusal.value.fix
    assert reason is None or refusal.value.reason == reason


def test_a_field_with_wrong_dimensions_is_never_called_good():
    """A 4 × 3 m field taken for 4 × 2 m: no camera sees it so, and the verdict says that."""
    camera = reference_camera("strong", 12)
    observations = border_observations(
        camera, REGION, 9, 0.3, np.random.default_rng(0), anywhere=True
    )
    flat = replace(REGION, y_mm=(-1000.0, 1000.0))
    try:
        made = calibration.calibrate(
            observations,
            plain_field(flat),
            flat,
            SIZE,
            "brown-conrady",
            {"height_mm": {"value": 4150.0, "sigma": 30.0}},
        )
    except FitFailed as refusal:
        assert refusal.fix
    else:
        assert made.report["verdict"]["level"] in ("poor", "fair")


points = st.lists(st.tuples(st.floats(-2, 1300), st.floats(-2, 1100)), max_size=14)


@settings(max_examples=60, deadline=None)
@given(st.tuples(points, points, points, points), st.sampled_from(RAYS))
def test_whatever_finite_clicks_come_it_answers_with_numbers_or_refuses(borders, model):
    observations = tuple(
        Observation(name, "line", np.array(p, float).reshape(-1, 2))
        for name, p in zip(("left", "right", "top", "bottom"), borders, strict=True)
    )
    try:
        made = FITTERS[model].fit(observations, FIELD, REGION, SIZE)
    except TouchlineError as refusal:
        assert refusal.fix
    else:
        MODELS[model].from_parameters(parameters_json(made.model))
        assert np.isfinite(made.covariance).all()


@rounds("seeds", 8, 40)
@pytest.mark.parametrize("model", RAYS)
def test_a_camera_that_sees_nothing_of_its_region_is_refused_not_broken(model, seeds):
    """Whatever a fit of clicks on one line ends at, judging it never meets a singular matrix."""
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        start, along = rng.uniform(100, 500, 2), rng.uniform(-1, 1, 2)
        clicks = tuple(
            Observation(name, "line", start + along * rng.uniform(0, 400, (9, 1)))
            for name in ("left", "right", "top", "bottom")
        )
        with pytest.raises(FitFailed):
            calibration.calibrate(clicks, FIELD, REGION, SIZE, model)


@pytest.mark.parametrize("hat_mm", [75.0, 150.0])
def test_hat_height_is_the_fields_own_everywhere_it_is_judged(hat_mm):
    field = replace(FIELD, hat_height_mm=hat_mm)
    camera = reference_camera("strong", 0)
    observations = border_observations(
        camera, REGION, 9, 0.3, np.random.default_rng(0), anywhere=True
    )
    made = calibration.calibrate(
        observations, field, REGION, SIZE, "brown-conrady", cross_validate=False
    )
    assert made.report["sigma_mm"]["hat"]["z_mm"] == made.report["next_click"]["z_mm"] == hat_mm
    assert made.report["sigma_mm"]["hat"]["rms"] == expected_error(made.fit, REGION, hat_mm).rms
    (told,) = [w["text"] for w in made.report["warnings"] if w["reason"] == "height-unknown"]
    assert f"at robot-top height ({hat_mm:g} mm)" in told
    assert (
        weakest_direction(made.fit, REGION, hat_mm).robot_top_mm
        == expected_error(made.fit, REGION, hat_mm).rms
    )
    ranked = model_choice.compare(
        observations, field, REGION, SIZE, ("division", "homography")
    ).ranking
    by_name = {row["model"]: row for row in ranked["ranking"]}
    assert (
        by_name["division"]["hat_height_mm"] == hat_mm
        and by_name["homography"]["hat_height_mm"] is None
    )
    straight = reference_camera("none", 0)
    marks = landmark_observations(*known_grid(straight, REGION, 5, 5), 0.1)
    clicks = (*border_observations(straight, REGION, 9, 0.1), *marks)
    flat = calibration.calibrate(clicks, field, REGION, SIZE, "homography")
    assert f"Robot tops ({hat_mm:g} mm)" in flat.report["verdict"]["sentence"]


@rounds("seeds", 5, 16)
def test_terms_that_the_clicks_do_not_tell_are_held_by_what_lenses_are(seeds):
    """36 clicks hardly tell k2, and k3 and decentring not at all: the fit with all of them loses next to nothing."""
    camera = reference_camera("strong", 0)
    given, own = (
        np.linalg.norm(
            [
                carpet_and_hat_mm(fitted(camera, seed, **CENTRED, **terms), camera)[0]
                for seed in range(seeds)
            ]
        )
        for terms in ({"terms": ["k1", "k2"]}, {})
    )
    assert own < 1.2 * given


@pytest.mark.parametrize("seed", range(6))
def test_no_term_runs_away_from_few_clicks_on_a_plain_lens(seed):
    """Without a prior, k2 and k3 of 20 clicks reach tens, with opposite signs, and the field's inside is lost."""
    camera = reference_camera("none", 8)
    observations = border_observations(
        camera, REGION, 5, 0.5, np.random.default_rng(seed), anywhere=True
    )
    fit = FITTERS["brown-conrady"].fit(observations, FIELD, REGION, SIZE)
    assert np.abs(fit.model.lens_terms).max() < 1
    assert carpet_and_hat_mm(fit, camera)[0] < 25


@pytest.mark.parametrize(("height_mm", "named"), [(25_000.0, {"unusual-height"}), (6000.0, set())])
def test_a_camera_that_hangs_where_none_does_is_named(height_mm, named):
    """Tilted by 20°, its clicks tell the height."""
    fit = fitted(reference_camera("mild", 20, height_mm), 0, noise_px=0.05, tape=False)
    assert {w.reason for w in fit.warnings} == named


@pytest.mark.parametrize(("wider_mm", "named"), [(40.0, {"top"}), (6.0, set())])
def test_lines_that_are_not_where_the_field_has_them_are_named(wider_mm, named):
    """The field in the picture is wider than the one that was chosen."""
    painted = replace(REGION, y_mm=(REGION.y_mm[0] - wider_mm, REGION.y_mm[1] + wider_mm))
    camera = reference_camera("mild", 20)
    inside, places = known_grid(
        camera, replace(REGION, x_mm=(-900.0, 900.0), y_mm=(-600.0, 600.0)), 4, 4
    )
    fit = FITTERS["brown-conrady"].fit(
        (
            *border_observations(camera, painted, 9, 0.3, np.random.default_rng(0)),
            *landmark_observations(inside, places),
        ),
        replace(FIELD, line_sigma_mm=3.0),
        REGION,
        SIZE,
        {},
    )
    told = [w for w in fit.warnings if w.reason == "misplaced-lines"]
    assert len(told) == bool(named)
    for warning in told:
        assert all(f"{name} border by" in warning.text for name in named), warning.text
        assert "measure" in warning.fix


@pytest.mark.parametrize(
    ("change", "named", "words"),
    [
        ({}, None, ""),
        ({"log_focal": np.log(200.0)}, "unusual-focal-length", "145°"),
        ({"log_focal": np.log(8000.0)}, "unusual-focal-length", "9°"),
        ({"aspect": 1.02}, "unusual-aspect", "1.020"),
        ({"centre_px": np.array([700.0, 511.5])}, "unusual-principal-point", "60 px"),
        ({"position_mm": np.array([0.0, 0.0, 900.0])}, "unusual-height", "0.9 m"),
    ],
)
def test_each_unknown_that_ended_where_hardly_a_cameras_is_has_its_warning(change, named, words):
    options = read_options(FITTERS["brown-conrady"].OPTIONS, {"aspect_sigma": 0.002})
    state = replace(RayCameraParameters.of(true_camera(reference_camera())), **change)
    priors = camera_priors(state.lens, (), options, FIELD, SIZE, 720.0)
    warnings = unusual_camera_warnings(state, priors, SIZE, FIELD)
    assert [w.reason for w in warnings] == ([named] if named else [])
    assert all(words in w.text and w.fix for w in warnings)
