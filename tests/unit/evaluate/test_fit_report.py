"""What a fit is worth: residuals, Eq. (9), held-out error, and a verdict that admits what it cannot see."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.fields import FULL, grid, marks_seen, plain_field, seen
from tests.support.reference_camera import SIZE, reference_camera, reference_field
from tests.support.sim_clicks import border_observations, known_grid, rms_mm
from tests.support.tiers import long
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation
from touchline.evaluate.distortion import clicked_sag_pct, distortion_kind, sag_pct
from touchline.evaluate.report import report
from touchline.evaluate.residuals import feature_residuals
from touchline.evaluate.uncertainty import grid_over
from touchline.fitting import FITTERS
from touchline.models import field_from_raw, raw_from_field
from touchline.workflows import calibration

BARREL, PINCUSHION, TILTED = plain_examples("polynomial")


def calibrated(model=PINCUSHION, *extra, noise_px=0.3, seed=0, **options):
    observations = (
        *seen(model, model.region, 9, noise_px=noise_px, rng=np.random.default_rng(seed)),
        *extra,
    )
    return calibration.calibrate(
        observations, plain_field(model.region), model.region, model.image_size, options=options
    )


def test_a_bow_outwards_is_negative_and_a_bow_inwards_positive():
    x = np.linspace(0, 1000, 101)
    inside = np.array([500.0, 400.0])
    # a top border; y grows downwards, to the inside
    for sag, expected in ((-20.0, -2.0), (20.0, 2.0), (0.0, 0.0)):
        top = np.stack([x, 100 + sag * 4 * (x / 1000) * (1 - x / 1000)], axis=-1)
        assert sag_pct(top, inside) == pytest.approx(expected, abs=1e-2)
        assert sag_pct(top[::-1], inside) == pytest.approx(expected, abs=1e-2)
    assert [distortion_kind(p) for p in (-2.4, 0.1, 1.0)] == ["barrel", "none", "pincushion"]


@pytest.mark.parametrize(
    "lens, kind",
    [("strong", "barrel"), ("half", "barrel"), ("none", "none"), ("pincushion", "pincushion")],
)
def test_the_distortion_of_a_real_lens_has_its_sign_and_is_gone_after(lens, kind):
    camera, field = reference_camera(lens), reference_field()
    clicks = border_observations(camera, field.regions["full"], 9, 0.3, np.random.default_rng(1))
    found = calibration.calibrate(clicks, field, field.regions["full"], SIZE).report["distortion"]
    assert found["kind"] == kind
    assert abs(found["after_pct"]) < 0.1
    for border in BORDERS:
        truth = sag_pct(
            camera.raw_from_field(field.regions["full"].border(border).sample(201)),
            np.array(SIZE.centre),
        )
        assert found["per_border"][border]["before_pct"] == pytest.approx(truth, abs=0.12)
        assert abs(found["per_border"][border]["after_pct"]) < 0.15


def test_without_a_height_from_straight_above_no_error_at_robot_tops_is_told():
    camera, field = reference_camera("strong", 0), reference_field()
    region, tape = (
        field.regions["full"],
        {"height_mm": {"value": float(camera.position_mm[2]), "sigma": 30.0}},
    )
    clicks = border_observations(camera, region, 9, 0.3, np.random.default_rng(0))
    for options, is_known in (({}, False), (tape, True)):
        report = calibration.calibrate(
            clicks, field, region, SIZE, "brown-conrady", options=options, cross_validate=False
        ).report
        assert report["sigma_mm"]["hat"]["known"] is is_known
        assert (report["sigma_mm"]["hat"]["rms"] <= 15) is is_known
        assert ("at robot tops is unknown" in report["verdict"]["sentence"]) is not is_known
        assert "be off by about" not in report["verdict"]["sentence"]


def test_a_bow_of_clicks_needs_four():
    assert clicked_sag_pct(np.array([[0.0, 0], [1, 0], [2, 0]]), 0, np.array([1.0, 5.0])) is None


def test_a_residual_is_the_distance_to_the_line_in_pixels_and_on_the_carpet():
    foot = PINCUSHION.raw_from_corrected(
        PINCUSHION.corrected_from_field(np.array([[-2000.0, 300.0], [-2000, -700]]))
    )
    off = PINCUSHION.raw_from_corrected(
        PINCUSHION.corrected_from_field(np.array([[-1990.0, 300.0], [-2007, -700]]))
    )
    found = feature_residuals(PINCUSHION, Observation("left", "line", off), plain_field(), FULL)
    np.testing.assert_allclose(found.mm, [10, 7], atol=1e-9)
    np.testing.assert_allclose(found.foot, foot, atol=1e-9)
    np.testing.assert_allclose(found.px, np.linalg.norm(off - foot, axis=1), atol=1e-9)


def test_the_report_is_plain_json_with_every_promised_field():
    report = json.loads(json.dumps(calibrated().report, allow_nan=False))
    assert {
        "rms_px",
        "max_px",
        "rms_mm",
        "max_mm",
        "cv_rms_mm",
        "inliers",
        "outliers",
        "sigma_mm",
        "distortion",
        "per_feature",
        "warnings",
        "verdict",
        "degree",
    } <= set(report)
    assert [f["feature"] for f in report["per_feature"]] == list(BORDERS)
    assert all(len(f["residuals"]) == f["n"] == 9 for f in report["per_feature"])
    assert report["inliers"] == 36 and report["outliers"] == 0


@pytest.mark.parametrize("noise_px", [long(0.1), 0.3, long(1.0)])
def test_held_out_error_is_larger_than_the_residuals_and_near_the_truth_on_the_borders(noise_px):
    rows = []
    for seed in range(8):
        found = calibrated(noise_px=noise_px, seed=seed, degree=2)
        places = np.concatenate([FULL.border(b).sample(40) for b in BORDERS])
        raw = PINCUSHION.raw_from_corrected(PINCUSHION.corrected_from_field(places))
        curve = np.mean(np.sum((field_from_raw(found.model, raw) - places) ** 2, axis=1))
        # the held-out click has its own noise, 3.45 mm per pixel
        error = np.sqrt(curve + (noise_px * 3.45) ** 2)
        rows.append((found.report["rms_mm"], found.report["cv_rms_mm"], error))
    residual, held_out, truth = np.median(rows, axis=0)
    assert residual < held_out
    assert held_out == pytest.approx(truth, rel=0.35)


def test_borders_alone_say_nothing_of_the_inside_and_a_lens_on_the_same_points_does():
    """A small residual on the borders proves nothing inside: 36 mm are there, and the headline has them."""
    camera, field = reference_camera("strong"), reference_field()
    region = field.regions["full"]
    clicks = border_observations(camera, region, 9, 0.3, np.random.default_rng(0))
    found = calibration.calibrate(clicks, field, region, SIZE)
    raw, truth = known_grid(camera, region, 21, 17)
    true_mm = rms_mm(field_from_raw(found.model, raw), truth)
    assert true_mm > 30
    assert found.report["rms_mm"] < 3
    assert found.report["verdict"]["level"] == "poor"
    assert found.report["verdict"]["mm"] == pytest.approx(true_mm, rel=0.15)
    assert "same points" in found.report["verdict"]["sentence"]
    told = {w["reason"]: w["fix"] for w in found.report["warnings"]}
    assert (
        set(told) == {"inside-not-checked", "another-lens"}
        and "Add a few points" in told["inside-not-checked"]
    )


def test_borders_alone_are_unknown_inside_where_no_lens_contradicts():
    """A lens that bends the borders by next to nothing: its inside is fine, and nothing but a lens could know it."""
    camera, field = reference_camera("none"), reference_field()
    region = field.regions["full"]
    clicks = border_observations(camera, region, 9, 0.3, np.random.default_rng(0))
    verdict = calibration.calibrate(clicks, field, region, SIZE).report["verdict"]
    assert verdict["level"] == "unknown" and "inside" in verdict["sentence"]


def test_a_lens_that_explains_the_points_much_worse_contradicts_nothing():
    """A picture that was bent by software as no lens bends: curves follow it, and a lens has no say."""
    camera, field = reference_camera("none"), reference_field()
    region = field.regions["full"]

    def bent(raw):
        x, y = ((raw - (640, 512)) / 600).T
        return raw + 40 * np.stack([np.sin(3 * y), np.sin(3 * x)], axis=1)

    clicks = [replace(o, points=bent(o.points)) for o in border_observations(camera, region, 25)]
    inside, mm = known_grid(camera, region, 5, 4)
    marks = [
        Observation(tuple(map(float, p)), "landmark", bent(r[None]))
        for r, p in zip(inside.reshape(-1, 2), mm.reshape(-1, 2), strict=True)
    ]
    report = calibration.calibrate((*clicks, *marks), field, region, SIZE, "polynomial").report
    assert "another-lens" not in {w["reason"] for w in report["warnings"]}


def test_a_mark_inside_that_fits_badly_makes_the_verdict_poor():
    field = plain_field()
    marks = [
        Observation(
            (x, y),
            "landmark",
            TILTED.raw_from_corrected(TILTED.corrected_from_field(np.array([[x, y]]))),
        )
        for x, y in ((0.0, 0.0), (500.0, 200.0), (-700.0, -300.0), (900.0, 0.0))
    ]
    observations = (*seen(TILTED, FULL, 9), *marks)
    found = calibration.calibrate(
        observations, field, FULL, ImageSize(1280, 1024), options={"relation_degree": 1}
    )
    assert found.report["verdict"]["level"] == "poor"
    assert found.report["verdict"]["mm"] > 50
    assert (
        calibration.calibrate(
            (*seen(TILTED, FULL, 9), *marks_seen(TILTED, field)), field, FULL, ImageSize(1280, 1024)
        ).report["verdict"]["level"]
        == "good"
    )


def test_a_stray_counts_neither_in_the_residuals_nor_in_the_held_out_error():
    clean = calibrated(noise_px=0.2, degree=2).report
    observations = list(seen(PINCUSHION, FULL, 9, noise_px=0.2, rng=np.random.default_rng(0)))
    off = np.array([[20.0, 0.0]]) * (np.arange(9) == 4)[:, None]
    observations[0] = Observation("left", "line", observations[0].points + off)
    found = calibration.calibrate(
        tuple(observations), plain_field(), FULL, PINCUSHION.image_size, options={"degree": 2}
    )
    assert found.report["outliers"] == 1
    assert found.report["cv_rms_mm"] == pytest.approx(clean["cv_rms_mm"], rel=0.2)
    assert found.report["per_feature"][0]["residuals"][4]["outlier"] is True
    assert found.report["per_feature"][0]["residuals"][4]["px"] > 15


def test_one_border_at_once_is_the_border_of_the_whole():
    points = seen(BARREL, BARREL.region, 9, noise_px=0.3, rng=np.random.default_rng(2))[0].points
    alone = calibration.fit_border(points, "x_of_y", 3, BARREL.image_size)
    whole = calibrated(BARREL, noise_px=0.3, seed=2, degree=3)
    rows = np.linspace(60, 500, 9)
    np.testing.assert_allclose(
        np.polynomial.Polynomial(alone["coefficients"])(rows), whole.model.left(rows), atol=1e-6
    )
    assert alone["kind"] == "barrel" and alone["distortion_pct"] < 0
    assert alone["residuals_px"] == pytest.approx(
        points[:, 0] - whole.model.left(points[:, 1]), abs=1e-6
    )


def test_the_overlay_draws_the_field_where_the_clicks_were():
    found = calibrated(BARREL, noise_px=0.0, degree=4)
    shapes = calibration.overlay(found.model, plain_field(BARREL.region), BARREL.region)
    assert {s["kind"] for s in shapes} == {"border", "line", "arc", "landmark"}
    left = np.array(next(s for s in shapes if s["feature"] == "left")["points"])
    np.testing.assert_allclose(left[:, 0], BARREL.left(left[:, 1]), atol=1e-6)


@pytest.mark.parametrize("source", ["image", "corrected", "field"])
@pytest.mark.parametrize("target", ["image", "corrected", "field"])
def test_transform_goes_there_and_back_between_all_spaces(source, target):
    start = calibration.transform(BARREL, grid(780, 580, 5, 4), "image", source)
    there = calibration.transform(BARREL, start, source, target)
    np.testing.assert_allclose(
        calibration.transform(BARREL, there, target, source), start, atol=1e-5
    )


@pytest.mark.parametrize("camera", plain_examples("brown-conrady")[:3])
def test_transform_at_hat_height_follows_the_rays_whichever_picture_is_asked(camera):
    """A robot's hat is seen centimetres away from where it stands: its height must not be forgotten on the way."""
    region = camera.region
    hats = region.field_from_region(grid(region.width_mm, region.height_mm, 5, 4))
    seen_hats = camera.project(np.concatenate([hats, np.full((4, 5, 1), 150.0)], axis=-1))
    np.testing.assert_allclose(
        calibration.transform(camera, seen_hats, "image", "field", 150.0), hats, atol=1e-5
    )
    np.testing.assert_allclose(
        calibration.transform(camera, hats, "field", "image", 150.0), seen_hats, atol=1e-9
    )
    drawn = calibration.transform(camera, seen_hats, "image", "corrected")
    np.testing.assert_allclose(
        calibration.transform(camera, hats, "field", "corrected", 150.0), drawn, atol=1e-6
    )
    np.testing.assert_allclose(
        calibration.transform(camera, drawn, "corrected", "field", 150.0), hats, atol=1e-5
    )
    on_carpet = calibration.transform(camera, seen_hats, "image", "field")
    assert np.linalg.norm(on_carpet - hats, axis=-1).max() > 30


@pytest.mark.parametrize("model", FITTERS)
def test_two_clicks_at_one_place_are_one_click(model):
    field = reference_field()
    region = field.regions["full"]
    clicks = border_observations(
        reference_camera("mild", 8), region, 9, 0.3, np.random.default_rng(0), anywhere=True
    )
    twice = tuple(
        replace(o, points=np.concatenate([o.points, o.points[::3] + 0.1])) for o in clicks
    )
    plain, doubled = (calibration.calibrate(o, field, region, SIZE, model) for o in (clicks, twice))
    places = grid_over(region, 9, 7)
    np.testing.assert_allclose(
        field_from_raw(doubled.model, raw_from_field(plain.model, places)), places, atol=0.05
    )
    assert doubled.report["verdict"]["mm"] == pytest.approx(plain.report["verdict"]["mm"], abs=0.02)


@pytest.mark.parametrize("model", ["ssl", "homography"])
def test_a_model_that_a_freer_lens_contradicts_is_not_good(model):
    """Of a strong lens one term tells the borders; what it makes of the inside no residual shows."""
    camera, field = reference_camera("strong", 8), reference_field()
    region = field.regions["full"]
    clicks = border_observations(camera, region, 9, 0.3, np.random.default_rng(1))
    raw, truth = known_grid(camera, region, 21, 17)

    def made(name, **more):
        tape = (
            {"height_mm": {"value": float(camera.position_mm[2]), "sigma": 30.0}}
            if name != "homography"
            else {}
        )
        return calibration.calibrate(clicks, field, region, SIZE, name, tape, **more)

    rigid, freer, dragged = made(model), made("brown-conrady"), made(model, cross_validate=False)
    told = {w["reason"]: w for w in rigid.report["warnings"]}
    assert (
        rms_mm(field_from_raw(rigid.model, raw), truth)
        > 7.5
        > rms_mm(field_from_raw(freer.model, raw), truth)
    )
    assert (
        rigid.report["verdict"]["level"] in ("fair", "poor")
        and freer.report["verdict"]["level"] == "good"
    )
    assert (
        "Use " in told["another-lens"]["fix"] and "places the field" in told["another-lens"]["text"]
    )
    # nothing freer is asked; nothing is asked while a point is dragged
    for other in (freer, dragged):
        assert "another-lens" not in {w["reason"] for w in other.report["warnings"]}


@pytest.mark.parametrize("folds_at, told", [(0.45, True), (0.605, True), (1.2, False)])
def test_a_lens_that_folds_back_at_the_field_or_inside_it_is_named_and_never_good(folds_at, told):
    """The field's corners are seen at a tangent of 0.6."""
    straight = plain_examples("brown-conrady")[0]
    k1, k2 = -0.1, 0.0
    k3 = -(1 + 3 * k1 * folds_at**2) / (7 * folds_at**6)
    model = replace(
        straight,
        lens_terms=(k1, k2, 0, 0, k3, 0, 0, 0),
        image_size=ImageSize(1600, 1300),
        centre_px=(799.5, 649.5),
        position_mm=(0.0, 0.0, 4150.0),
        rotation=(np.pi, 0.0, 0.0),
    )
    region, field = model.region, plain_field(model.region)
    clicks = seen(
        replace(straight, image_size=model.image_size, centre_px=model.centre_px), region, 9
    )
    fit = FITTERS["brown-conrady"].fit(
        clicks, field, region, model.image_size, {"line_sigma_mm": 0.0}
    )
    found = report(replace(fit, model=model, inliers=(), used=()), (), field, region, None)
    warnings = {w["reason"]: w["text"] for w in found["warnings"]}
    assert ("lens-ends" in warnings) == told
    assert not told or found["verdict"]["level"] != "good"
    corner = model.project(np.array([[2000.0, 1500.0, 0.0]]))
    assert np.isfinite(corner).all() == (folds_at > 0.603)
