"""What two cameras share tells how far apart they put it: matches, lines, arcs and landmarks, in their directions."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.fields import FULL, plain_field
from tests.support.pairs import simulated
from touchline.core.errors import FitFailed
from touchline.core.geometry import inside_picture
from touchline.core.records import Observation
from touchline.evaluate.agreement import agreement, shared_area
from touchline.evaluate.offsets import from_clicks, from_matches
from touchline.models import raw_from_field

FIELD = plain_field()


def agreeing(seed=9):
    pair = simulated(seed, flat=True, mistakes=0.0, noise_px=0.0, k=-0.2)
    return pair, pair.clean_a[:300], pair.clean_b[:300]


def apart_mm(evidence):
    """Of each thing that was measured."""
    return evidence.by_thing(evidence.offset_mm)[1]


def judged(a, b, evidence):
    return agreement(a, a.image_size, b, b.image_size, FIELD, evidence)


def test_right_calibrations_agree_and_a_shift_shows_its_length_and_direction():
    pair, a, b = agreeing()
    assert apart_mm(from_matches(pair.camera_a, pair.camera_b, a, b, 0.0)).max() < 1e-5
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y - 5.0, z))
    found = from_matches(pair.camera_a, moved, a, b, 0.0)
    np.testing.assert_allclose(found.offset_mm.reshape(-1, 2), [[12.0, -5.0]] * len(a), atol=1e-5)
    report = judged(pair.camera_a, moved, found)
    assert report["n"] == report["believed"] == 2 * len(a) and report["outliers"] == []
    assert report["median_mm"] == pytest.approx(13.0) and report["rms_mm"] == pytest.approx(13.0)
    assert report["shift_mm"] == pytest.approx([12.0, -5.0], abs=1e-3)
    cells = np.array(report["carpet"]["map"]["mm"], float)
    assert np.nanmax(np.abs(cells - 13.0)) < 1e-3
    assert 0.2 < report["covered"] <= 1.0
    assert 0 < report["overlap_m2"] <= 12.0


def test_the_map_is_blank_where_one_camera_sees_nothing():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 6000.0, y, z))
    shared = shared_area(pair.camera_a, pair.camera_a.image_size, moved, moved.image_size, FIELD)
    for model in (pair.camera_a, moved):
        seen = inside_picture(raw_from_field(model, shared.places), model.image_size)
        assert (shared.both <= seen).all()
    assert 0.1 < shared.both.mean() < 1


def test_the_worst_match_is_named_with_its_place_and_is_an_outlier():
    pair, a, b = agreeing()
    spoilt = b.copy()
    spoilt[17] += 8.0
    report = judged(
        pair.camera_a, pair.camera_b, from_matches(pair.camera_a, pair.camera_b, a, spoilt, 0.0)
    )
    assert report["median_mm"] < 1e-5 < 20 < report["max_mm"] and report["carpet"]["max_mm"] < 0.1
    assert report["outliers"] == [17] and report["believed"] == 2 * len(a) - 2
    np.testing.assert_allclose(report["where"], pair.camera_a.unproject(a[17]), atol=40)


def test_a_height_shows_where_only_the_carpet_was_right():
    """Hats at 150 mm: placed at their height both cameras agree, taken for carpet they are centimetres apart."""
    pair = simulated(10, noise_px=0.0, mistakes=0.0)
    hats = np.column_stack(
        [np.random.default_rng(0).uniform([-800, -800], [800, 800], (30, 2)), np.full(30, 150.0)]
    )
    a, b = pair.camera_a.project(hats), pair.camera_b.project(hats)
    assert apart_mm(from_matches(pair.camera_a, pair.camera_b, a, b, z_mm=150.0)).max() < 1e-6
    assert np.median(apart_mm(from_matches(pair.camera_a, pair.camera_b, a, b, z_mm=0.0))) > 50
    with pytest.raises(FitFailed) as refusal:
        from_matches(plain_examples("homography")[0], pair.camera_b, a, b, z_mm=150.0)
    assert refusal.value.reason == "no-rays"


def test_lines_and_landmarks_clicked_in_both_pictures_tell_as_much():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y, z))

    def seen(model, names, count):
        return tuple(
            Observation(n, "line", raw_from_field(model, FIELD.feature(n, FULL).sample(count)))
            for n in names
        )

    found = from_clicks(
        pair.camera_a,
        (*seen(pair.camera_a, ("at-x-1", "at-y-2"), 7), spot(pair.camera_a)),
        FULL,
        moved,
        (*seen(pair.camera_b, ("at-x-1", "at-y-2"), 5), spot(pair.camera_b)),
        FULL,
        FIELD,
    )
    # of two lines; the landmark, in two directions, comes last
    line = np.isin(found.thing, found.thing[:-2])
    across_x = line & (np.abs(found.places[:, 0] + 800) < 20)
    assert across_x.any()
    np.testing.assert_allclose(
        found.offset_mm[across_x], 12.0 * found.normals[across_x, 0], atol=1e-3
    )
    along_x = line & ~across_x
    # the shift runs along that line: it cannot be seen there
    assert np.abs(found.offset_mm[along_x]).max() < 1e-3
    np.testing.assert_allclose(found.offset_mm[-2:], [12.0, 0.0], atol=1e-3)
    assert apart_mm(found)[-1] == pytest.approx(12.0, abs=1e-3)


def test_arcs_clicked_in_both_pictures_tell_as_much():
    pair, _, _ = agreeing()
    x, y, z = pair.camera_b.position_mm
    moved = replace(pair.camera_b, position_mm=(x + 12.0, y, z))
    circle = FIELD.arcs["circle"]

    def seen(model, count):
        return (Observation("circle", "line", raw_from_field(model, circle.sample(count)[:-1])),)

    found = from_clicks(
        pair.camera_a, seen(pair.camera_a, 23), FULL, moved, seen(pair.camera_b, 17), FULL, FIELD
    )
    radial = (found.places - np.array(circle.centre)) / circle.radius_mm
    # straight between clicks
    np.testing.assert_allclose(found.offset_mm, 12.0 * radial[:, 0], atol=1.0)
    assert apart_mm(found).max() > 11


def test_landmarks_a_millimetre_apart_are_one():
    """Two files of a field may have a spot at 0 and at 0.4 mm, as the check of a rig allows."""
    pair, _, _ = agreeing()
    other = Observation(
        (0.4, 0.0), "landmark", raw_from_field(pair.camera_b, np.array([[0.0, 0.0]]))
    )
    found = from_clicks(
        pair.camera_a, (spot(pair.camera_a),), FULL, pair.camera_b, (other,), FULL, FIELD
    )
    assert len(apart_mm(found)) == 1 and apart_mm(found)[0] < 1e-3


def spot(model):
    return Observation("mark-2-2", "landmark", raw_from_field(model, np.array([[0.0, 0.0]])))


def test_nothing_shared_is_said():
    pair, _, _ = agreeing()
    one = (Observation("at-x-1", "line", np.array([[600.0, 300.0], [600.0, 500.0]])),)
    other = (Observation("at-x-3", "line", np.array([[600.0, 300.0], [600.0, 500.0]])),)
    with pytest.raises(FitFailed) as refusal:
        from_clicks(pair.camera_a, one, FULL, pair.camera_b, other, FULL, FIELD)
    assert refusal.value.reason == "nothing-shared"
    x, y, z = pair.camera_b.position_mm
    away = replace(pair.camera_b, position_mm=(x + 50_000.0, y, z))
    with pytest.raises(FitFailed) as refusal:
        shared_area(pair.camera_a, pair.camera_a.image_size, away, away.image_size, FIELD)
    assert refusal.value.reason == "no-overlap"
