"""Two views: their geometry from matches with mistakes among them, and what is refused rather than guessed."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.fields import FULL, plain_field
from tests.support.pairs import KUSVOD2, PAIRS, eight_point, epipolar_error_px, ideal, labelled_matches, simulated
from tests.support.tiers import rounds
from touchline.core.errors import BadInput, FitFailed
from touchline.core.records import Observation
from touchline.evaluate.cameras.pair_agreement import CELLS, from_matches, from_observations
from touchline.evaluate.cameras.shared_area import overlap
from touchline.fitting.two_view.epipolar import FundamentalParameters, sampson_px
from touchline.fitting.two_view.fundamental_matrix import fundamental_matrix
from touchline.fitting.two_view.relative_pose import (
    RelativePoseParameters,
    calibrated_epipolar_px,
    ideal_px,
    pose_between,
    relative_pose,
)
from touchline.models import raw_from_field
from touchline.models.rotation import vector_from_matrix

FIELD = plain_field()


def degrees_between(u, v):
    return float(np.degrees(np.arccos(np.clip(u @ v / np.linalg.norm(u) / np.linalg.norm(v), -1, 1))))


@cache
def matched(seed, uneven):
    """A pair of views with mistakes among their matches, and the geometry found; once for all tests of this file."""
    pair = simulated(seed, uneven=uneven)
    return pair, fundamental_matrix(pair.a, pair.b, seed)


@rounds("seeds", 1, 5)
@pytest.mark.parametrize("uneven", [False, True])
def test_mistakes_are_found_and_the_rest_tells_the_geometry(uneven, seeds):
    errors = []
    for seed in range(seeds):
        pair, found = matched(seed, uneven)
        assert (found.good & ~pair.good).sum() <= 3  # a mistake may lie on its line by chance
        assert (found.good & pair.good).sum() > 0.8 * pair.good.sum()
        errors.append(epipolar_error_px(found.fundamental, pair.clean_a, pair.clean_b).mean())
    assert np.median(errors) < 0.2  # px, from clicks of 0.3 px
    assert max(errors) < 0.5


def test_exact_matches_give_the_exact_geometry():
    pair = simulated(1, noise_px=0.0, mistakes=0.0)
    found = fundamental_matrix(pair.a, pair.b)
    assert epipolar_error_px(found.fundamental, pair.clean_a, pair.clean_b).max() < 1e-6
    assert np.linalg.matrix_rank(found.fundamental, tol=1e-12) == 2
    eight = eight_point(pair.a, pair.b)
    assert epipolar_error_px(eight, pair.clean_a, pair.clean_b).max() < 1e-6


def test_its_error_figure_is_the_distance_to_the_lines_in_both_views():
    pair, found = matched(0, False)
    np.testing.assert_allclose(found.epipolar_px, epipolar_error_px(found.fundamental, pair.a, pair.b), rtol=1e-9)
    assert found.rms_px == pytest.approx(np.sqrt(np.mean(found.epipolar_px[found.good] ** 2)))
    in_a, in_b = found.epipoles
    np.testing.assert_allclose(found.fundamental @ in_a, 0, atol=1e-12)
    np.testing.assert_allclose(in_b @ found.fundamental, 0, atol=1e-12)


def test_the_same_seed_gives_the_same_answer_and_another_nearly_so():
    pair, first = matched(0, False)
    again, other = (fundamental_matrix(pair.a, pair.b, seed) for seed in (0, 1))
    np.testing.assert_array_equal(first.fundamental, again.fundamental)
    between = np.abs(first.epipolar_px - other.epipolar_px)[first.good & other.good]
    assert between.max() < 0.1


@pytest.mark.parametrize("state, a, b", [
    (lambda p: FundamentalParameters.of(eight_point(*ideal(p, "")), *ideal(p, "")), "a", "b"),
    (lambda p: RelativePoseParameters(pose_between(p.camera_a, p.camera_b)[0], np.array([0.6, 0.0, 0.8]), 900.0, 900.0),
     "a", "b")],
    ids=["F", "R and t"])
def test_the_derivatives_are_those_of_the_distances(state, a, b):
    pair = simulated(4, matches=40, mistakes=0.0)
    a, b = ideal(pair, "")
    start = state(pair)
    r, by = start.residuals(a, b)
    for n in range(by.shape[1]):
        step = 1e-6 * np.eye(by.shape[1])[n]
        ahead, behind = (start.retract(s * step).residuals(a, b)[0] for s in (1, -1))
        np.testing.assert_allclose(by[:, n], (ahead - behind) / 2e-6, rtol=1e-4, atol=1e-4 * np.abs(by[:, n]).max())
    np.testing.assert_allclose(np.abs(r), np.abs(sampson_px(start.fundamental(), a, b)), atol=1e-9)


@rounds("seeds", 4, 10)
def test_the_pose_is_told_as_well_as_it_says(seeds):
    turned, aimed, told = [], [], []
    for seed in range(seeds):
        pair = simulated(seed, k=-0.2)
        found = relative_pose(pair.camera_a, pair.camera_b, pair.a, pair.b)
        rotation, centre = pose_between(pair.camera_a, pair.camera_b)
        turned.append(np.degrees(np.linalg.norm(vector_from_matrix(found.b_from_a @ rotation.T))))
        aimed.append(degrees_between(found.direction, centre))
        told.append((found.rotation_sigma_deg, found.direction_sigma_deg))
    assert np.median(turned) < 0.2
    assert np.median(aimed) < 0.2
    seen = np.sqrt(np.mean(np.square([turned, aimed]), axis=1))
    np.testing.assert_allclose(seen, np.sqrt(np.mean(np.square(told), axis=0)), rtol=0.5)  # ten draws tell σ to 22 %


def test_calibrations_that_are_right_foretell_the_lines_and_one_knocked_does_not():
    pair = simulated(5, k=-0.2)
    assert calibrated_epipolar_px(pair.camera_a, pair.camera_b, pair.clean_a, pair.clean_b).max() < 1e-6
    knocked = replace(pair.camera_b, rotation=(pair.camera_b.rotation[0] + 0.01, *pair.camera_b.rotation[1:]))
    assert np.median(calibrated_epipolar_px(pair.camera_a, knocked, pair.clean_a, pair.clean_b)) > 1.0


def test_points_on_one_plane_are_refused_not_fitted():
    pair = simulated(6, matches=50, flat=True, mistakes=0.1)
    for call in (lambda: fundamental_matrix(pair.a, pair.b),
                 lambda: relative_pose(pair.camera_a, pair.camera_b, pair.a, pair.b)):
        with pytest.raises(FitFailed) as refusal:
            call()
        assert refusal.value.reason == "one-plane"


@rounds("seeds", 1, 3)
def test_mistakes_do_not_pass_for_points_off_the_carpet(seeds):
    """Of a hundred and fifty mistakes some lie on the lines of a geometry made from two others."""
    for seed in range(seeds):
        pair = simulated(seed, matches=300, flat=True, mistakes=0.5, noise_px=0.5)
        with pytest.raises(FitFailed) as refusal:
            fundamental_matrix(pair.a, pair.b, seed)
        assert refusal.value.reason == "one-plane"


def test_a_few_points_off_the_carpet_are_enough():
    flat, tall = simulated(6, flat=True, mistakes=0.0), simulated(6, mistakes=0.0)
    a, b = (np.concatenate([getattr(flat, s), getattr(tall, s)[:25]]) for s in "ab")
    found = fundamental_matrix(a, b)
    assert np.median(epipolar_error_px(found.fundamental, tall.clean_a, tall.clean_b)) < 0.5


def test_a_camera_that_only_turned_is_refused():
    pair = simulated(7, mistakes=0.0)
    turned = replace(pair.camera_a, rotation=(pair.camera_a.rotation[0], pair.camera_a.rotation[1] + 0.05,
                                              pair.camera_a.rotation[2]))
    places = np.random.default_rng(0).uniform([-1000, -800, 0], [1000, 800, 1000], (80, 3))
    with pytest.raises(FitFailed) as refusal:
        fundamental_matrix(pair.camera_a.project(places), turned.project(places))
    assert refusal.value.reason == "one-plane"
    with pytest.raises(FitFailed) as refusal:
        calibrated_epipolar_px(pair.camera_a, turned, pair.a, pair.b)
    assert refusal.value.reason == "no-baseline"


@rounds("seeds", 1, 4)
def test_matches_at_random_are_no_consensus(seeds):
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        a, b = (rng.uniform([0, 0], [1280, 1024], (60, 2)) for _ in range(2))
        with pytest.raises(FitFailed) as refusal:
            fundamental_matrix(a, b, seed)
        assert refusal.value.reason == "no-consensus"


def test_too_few_one_line_and_what_is_no_match_are_refused_by_name():
    pair = simulated(8)
    line = np.stack([np.linspace(0, 1000, 30), np.linspace(100, 600, 30)], axis=1)
    cases = [((pair.a[:11], pair.b[:11]), FitFailed, "too-few-points"),
             ((np.tile(pair.a[:5], (10, 1)), np.tile(pair.b[:5], (10, 1))), FitFailed, "too-few-points"),
             ((line, pair.b[:30]), FitFailed, "collinear-points"), ((pair.a[:30], line), FitFailed, "collinear-points"),
             ((pair.a, pair.b[:-1]), BadInput, "bad-matches"),
             ((np.where(pair.a == pair.a[3], np.nan, pair.a), pair.b), BadInput, "non-finite-points"),
             ((np.where(pair.a == pair.a[3], np.inf, pair.a), pair.b), BadInput, "non-finite-points")]
    for matches, kind, reason in cases:
        for call in (fundamental_matrix, lambda a, b: relative_pose(pair.camera_a, pair.camera_b, a, b)):
            with pytest.raises(kind) as refusal:
                call(*matches)
            assert refusal.value.reason == reason
            assert refusal.value.fix


@rounds("worlds", 4, 32)
def test_what_is_not_refused_is_right(worlds):
    """Few matches, up to nine mistakes in ten, one point repeated, the same view twice, and coordinates gone wild."""
    refused = 0
    for seed in range(worlds):
        rng = np.random.default_rng(seed)
        pair = simulated(seed % 4, matches=int(rng.integers(12, 40)), mistakes=float(rng.uniform(0, 0.9)))
        a, b = pair.a.copy(), pair.b.copy()
        if seed % 4 == 1:
            a[: len(a) // 2] = a[0]
        elif seed % 4 == 2:
            b = a + rng.normal(0, 0.2, a.shape)
        elif seed % 4 == 3:
            a[:, 0] = 1e6 * rng.normal(size=len(a))
        try:
            found = fundamental_matrix(a, b)
        except FitFailed as refusal:
            assert refusal.reason in ("too-few-points", "no-consensus", "one-plane")
            refused += 1
            continue
        assert seed % 4 < 2
        assert np.median(epipolar_error_px(found.fundamental, pair.clean_a, pair.clean_b)) < 1.5
    assert refused < 7 / 8 * worlds  # some of the sound ones are taken


@pytest.mark.skipif(not KUSVOD2.is_dir(), reason="the kusvod2 pairs are not beside the project")
@pytest.mark.parametrize("name, most_px", [("corr", 0.16), ("plant", 0.51), ("rotunda", 0.38)])
def test_hand_clicked_points_lie_on_their_lines(name, most_px):
    """Means as measured, and a fifth more. The hand-clicked points are among the matches, unmarked."""
    a, b, _, hand_a, hand_b = labelled_matches(name)
    found = fundamental_matrix(a, b)
    assert epipolar_error_px(found.fundamental, hand_a, hand_b).mean() < most_px


def agreeing(seed=9):
    pair = simulated(seed, flat=True, mistakes=0.0, noise_px=0.0, k=-0.2)
    return pair, pair.clean_a[:300], pair.clean_b[:300]


def test_right_calibrations_agree_and_a_shift_shows_its_length_and_direction():
    pair, a, b = agreeing()
    assert from_matches(pair.camera_a, pair.camera_b, a, b).apart_mm.max() < 1e-5
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y - 5.0, z))
    found = from_matches(pair.camera_a, moved, a, b)
    np.testing.assert_allclose(found.offset_mm, [[12.0, -5.0]] * len(a), atol=1e-5)
    shared = overlap(pair.camera_a, pair.camera_a.image_size, moved, moved.image_size, FIELD, CELLS)
    report = found.to_json(shared)
    assert report["median_mm"] == pytest.approx(13.0)
    assert report["shift_mm"] == pytest.approx([12.0, -5.0])
    cells = np.array(report["map"]["mm"], float)
    assert np.nanmax(np.abs(cells - 13.0)) < 1e-6
    assert 0.2 < report["covered"] <= 1.0
    assert 0 < report["overlap_m2"] <= 12.0


def test_the_map_is_blank_where_one_camera_sees_nothing():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 6000.0, y, z))
    shared = overlap(pair.camera_a, pair.camera_a.image_size, moved, moved.image_size, FIELD, CELLS)
    assert 0.1 < shared.both.mean() < 0.9
    everywhere = np.stack(np.meshgrid(shared.x, shared.y), axis=-1).reshape(-1, 2)
    cells = shared.filled(everywhere, np.ones(len(everywhere)))
    np.testing.assert_array_equal(np.isfinite(cells), shared.both)


def test_the_worst_place_is_named():
    pair, a, b = agreeing()
    spoilt = b.copy()
    spoilt[17] += 8.0
    found = from_matches(pair.camera_a, pair.camera_b, a, spoilt)
    shared = overlap(pair.camera_a, pair.camera_a.image_size, pair.camera_b, pair.camera_b.image_size, FIELD, CELLS)
    report = found.to_json(shared)
    assert report["median_mm"] < 1e-5 < 20 < report["max_mm"]
    np.testing.assert_allclose(report["where"], pair.camera_a.unproject(a[17]), atol=40)


def test_a_height_shows_where_only_the_carpet_was_right():
    """Hats at 150 mm: placed at their height both cameras agree, taken for carpet they are centimetres apart."""
    pair = simulated(10, noise_px=0.0, mistakes=0.0)
    hats = np.column_stack([np.random.default_rng(0).uniform([-800, -800], [800, 800], (30, 2)), np.full(30, 150.0)])
    a, b = pair.camera_a.project(hats), pair.camera_b.project(hats)
    assert from_matches(pair.camera_a, pair.camera_b, a, b, z_mm=150.0).apart_mm.max() < 1e-6
    assert np.median(from_matches(pair.camera_a, pair.camera_b, a, b).apart_mm) > 50
    with pytest.raises(FitFailed) as refusal:
        from_matches(plain_examples("homography")[0], pair.camera_b, a, b, z_mm=150.0)
    assert refusal.value.reason == "no-rays"


def test_lines_and_landmarks_clicked_in_both_pictures_tell_as_much():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y, z))

    def seen(model, names, count):
        return tuple(Observation(n, "line", raw_from_field(model, FIELD.feature(n, FULL).sample(count))) for n in names)
    found = from_observations(
        pair.camera_a, (*seen(pair.camera_a, ("at-x-1", "at-y-2"), 7), spot(pair.camera_a)), FULL,
        moved, (*seen(pair.camera_b, ("at-x-1", "at-y-2"), 5), spot(pair.camera_b)), FULL, FIELD)
    across_x = np.abs(found.places[:, 0] + 800) < 20
    np.testing.assert_allclose(found.offset_mm[across_x], [[12.0, 0.0]] * across_x.sum(), atol=1e-3)
    along_x = np.abs(found.places[:, 1]) < 1e-3
    assert found.apart_mm[along_x & ~across_x].min() < 1e-3  # the shift runs along that line: it cannot be seen there
    np.testing.assert_allclose(found.offset_mm[-1], [12.0, 0.0], atol=1e-3)


def test_arcs_clicked_in_both_pictures_tell_as_much():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y, z))
    circle = FIELD.arcs["circle"]

    def seen(model, count):
        return (Observation("circle", "line", raw_from_field(model, circle.sample(count)[:-1])),)
    found = from_observations(pair.camera_a, seen(pair.camera_a, 23), FULL, moved, seen(pair.camera_b, 17), FULL, FIELD)
    radial = (found.places - np.array(circle.centre)) / circle.radius_mm
    np.testing.assert_allclose(found.offset_mm, 12.0 * radial[:, :1] * radial, atol=1.0)  # straight between clicks
    assert found.apart_mm.max() > 11


def test_landmarks_a_millimetre_apart_are_one():
    """Two files of a field may have a spot at 0 and at 0.4 mm, as the check of a rig allows."""
    pair, _, _ = agreeing()
    other = Observation((0.4, 0.0), "landmark", raw_from_field(pair.camera_b, np.array([[0.0, 0.0]])))
    found = from_observations(pair.camera_a, (spot(pair.camera_a),), FULL, pair.camera_b, (other,), FULL, FIELD)
    assert len(found.places) == 1 and found.apart_mm[0] < 1e-3


def spot(model):
    return Observation("mark-2-2", "landmark", raw_from_field(model, np.array([[0.0, 0.0]])))


def test_nothing_shared_is_said():
    pair, _, _ = agreeing()
    one = (Observation("at-x-1", "line", np.array([[600.0, 300.0], [600.0, 500.0]])),)
    other = (Observation("at-x-3", "line", np.array([[600.0, 300.0], [600.0, 500.0]])),)
    with pytest.raises(FitFailed) as refusal:
        from_observations(pair.camera_a, one, FULL, pair.camera_b, other, FULL, FIELD)
    assert refusal.value.reason == "nothing-shared"
    x, y, z = pair.camera_b.position_mm
    away = replace(pair.camera_b, position_mm=(x + 50_000.0, y, z))
    with pytest.raises(FitFailed) as refusal:
        overlap(pair.camera_a, pair.camera_a.image_size, away, away.image_size, FIELD, CELLS)
    assert refusal.value.reason == "no-overlap"


def test_without_a_lens_ideal_pixels_are_the_pixels():
    pair = simulated(11)
    centre = np.array(pair.camera_a.centre_px)
    np.testing.assert_allclose(ideal_px(pair.camera_a, pair.a) + centre, pair.a, atol=1e-9)


def test_every_pair_is_beside_the_project_or_said_to_be_missing():
    if not KUSVOD2.is_dir():
        pytest.skip("the kusvod2 pairs are not beside the project")
    assert all(len(labelled_matches(name)[3]) >= 8 for name in PAIRS)
