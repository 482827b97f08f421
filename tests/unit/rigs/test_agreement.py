"""Two cameras of one truth agree; one that was knocked is found: where, how far, and which one."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.pair_over_field import FIELD
from tests.support.rig_over_field import true_models
from touchline.core.errors import FitFailed
from touchline.core.records import Observation
from touchline.evaluate.agreement import agreement, shared_area
from touchline.evaluate.offsets import (
    OffsetMeasurements,
    fit_offset_field,
    from_clicks,
    from_matches,
)
from touchline.models import raw_from_field
from touchline.models.rotation import matrix_from_vector, vector_from_matrix
from touchline.rigs.evidence import geometry, ideal_px
from touchline.rigs.fundamental_matrix import fundamental_matrix
from touchline.rigs.rig import Rectangles, most_common
from touchline.rigs.verdict import of_pair

rng = np.random.default_rng
KNOCK_MM = 30.0


@pytest.fixture(scope="module")
def models():
    return true_models()


def knocked(model, by_mm=(KNOCK_MM, 0.0)):
    """The calibration of before, of a camera that now sees all `by_mm` elsewhere."""
    x, y, z = model.position_mm
    return replace(model, position_mm=(x + by_mm[0], y + by_mm[1], z))


def seen_by(models, count=40, z=(0.0, 0.0), seed=0):
    """Things that both see: raw px of each, and their heights."""
    random = rng(seed)
    places = np.column_stack(
        [
            random.uniform(-200, 200, count),
            random.uniform(-2800, 2800, count),
            random.uniform(*z, count),
        ]
    )
    return models[0].project(places), models[1].project(places), places[:, 2]


def judged(a, b, evidence):
    return agreement(a, a.image_size, b, b.image_size, FIELD, evidence)


def test_two_calibrations_of_one_truth_agree(models):
    found = judged(*models, from_matches(*models, *seen_by(models)))
    assert found["carpet"]["max_mm"] < 1e-3 and found["hat"]["max_mm"] < 1e-3
    assert of_pair("North", "South", found, found["n"], "matches")["level"] == "good"


@pytest.mark.parametrize(
    "z", [(0.0, 0.0), (150.0, 150.0), (0.0, 300.0)], ids=["carpet", "hats", "low things"]
)
@pytest.mark.parametrize("by_mm", [(KNOCK_MM, 0.0), (0.0, -KNOCK_MM), (18.0, 24.0)], ids=str)
def test_a_camera_that_was_moved_is_found_with_its_amount(models, by_mm, z):
    a, b = models
    found = judged(a, knocked(b, by_mm), from_matches(a, knocked(b, by_mm), *seen_by(models, z=z)))
    for plane in ("carpet", "hat"):
        assert found[plane]["mean_mm"] == pytest.approx(KNOCK_MM, rel=0.1)
        assert found[plane]["max_mm"] == pytest.approx(KNOCK_MM, rel=0.1)
    if z == (0.0, 0.0):
        assert found["shift_mm"] == pytest.approx(by_mm, abs=1)


def test_a_camera_that_was_turned_is_worst_far_from_it(models):
    """Turned about the field's vertical through the camera: nothing moves below it, most in the farthest corner."""
    a, b = models
    turned = replace(b, rotation=turned_by(b, KNOCK_MM / 3700))
    found = judged(a, turned, from_matches(a, turned, *seen_by(models)))
    shared = shared_area(a, a.image_size, turned, turned.image_size, FIELD)
    away = np.where(shared.both, np.linalg.norm(shared.places - b.position_mm[:2], axis=-1), 0)
    truth = away * KNOCK_MM / 3700
    assert found["carpet"]["max_mm"] == pytest.approx(truth.max(), rel=0.1)
    worst = np.array(found["carpet"]["where"])
    assert np.linalg.norm(worst - b.position_mm[:2]) > 0.97 * away.max()
    assert found["hat"]["max_mm"] == pytest.approx(truth.max(), rel=0.1)


def turned_by(model, angle):
    return tuple(
        vector_from_matrix(model.camera_from_field @ matrix_from_vector(np.array([0, 0, angle])))
    )


def test_strays_among_the_matches_change_little(models):
    a, b = models
    pixels_a, pixels_b, z = seen_by(models)
    pixels_b[:6] = rng(1).uniform(100, 900, (6, 2))
    found = judged(a, knocked(b), from_matches(a, knocked(b), pixels_a, pixels_b, z))
    assert found["carpet"]["max_mm"] == pytest.approx(KNOCK_MM, rel=0.1)
    assert found["believed"] <= found["n"] - 8 and found["outliers"] == list(range(6))
    told = of_pair("North", "South", found, 40, "matches")
    assert "6 of 40 are outliers" in told["sentence"] and told["fix"].startswith(
        "Check match 1: is it the same point"
    )
    assert "Check the heights of the matched points" in told["fix"] and told["level"] == "poor"
    assert "outlier" not in of_pair("North", "South", found, 40, "pictures")["sentence"]


def test_one_stray_among_matches_that_agree_takes_the_good_verdict_and_is_named(models):
    a, b = models
    pixels_a, pixels_b, z = seen_by(models)
    pixels_b[4] += 30.0
    found = judged(a, b, from_matches(a, b, pixels_a, pixels_b, z))
    told = of_pair("North", "South", found, 40, "matches")
    assert (
        told["level"] == "fair"
        and "1 of 40 is an outlier" in told["sentence"]
        and "match 5" in told["fix"]
    )


def test_along_a_line_that_both_share_nothing_is_claimed(models):
    """The halfway line alone: a shift across it is found, one along it is said to be unknown."""
    a, b = models
    line = FIELD.lines["halfway-line"].sample(30)
    clicks = [Observation("halfway-line", "line", raw_from_field(model, line)) for model in models]
    regions = [FIELD.region(half) for half in ("half-left", "half-right")]
    for by_mm, told in (((KNOCK_MM, 0.0), KNOCK_MM), ((0.0, KNOCK_MM), 0.0)):
        other = knocked(b, by_mm)
        found = judged(
            a, other, from_clicks(a, clicks[:1], regions[0], other, clicks[1:], regions[1], FIELD)
        )
        assert not found["both_directions"]
        assert found["carpet"]["max_mm"] == pytest.approx(told, rel=0.1, abs=0.5)
        assert (
            "one direction only"
            in of_pair("North", "South", found, found["n"], "clicks")["sentence"]
        )


def test_which_camera_it_was_is_told_by_the_fields_own_lines(models):
    a, b = models
    regions = [FIELD.region(half) for half in ("half-left", "half-right")]
    seen = [
        tuple(
            Observation(name, "line", points[np.isfinite(points).all(axis=1)])
            for name, points in (
                ("halfway-line", raw_from_field(m, FIELD.lines["halfway-line"].sample(20))),
                ("centre-circle", raw_from_field(m, FIELD.arcs["centre-circle"].sample(40))),
            )
        )
        for m in models
    ]
    found = judged(
        a, knocked(b), from_clicks(a, seen[0], regions[0], knocked(b), seen[1], regions[1], FIELD)
    )
    assert found["own_mm"]["a"] < 0.1 and found["own_mm"]["b"] > 15
    assert "The error is in South" in of_pair("North", "South", found, found["n"], "clicks")["fix"]


def test_what_is_seen_by_nobody_or_tells_nothing_is_refused(models):
    a, b = models
    with pytest.raises(FitFailed) as refused:
        OffsetMeasurements.together([])
    assert refused.value.reason == "nothing-shared"
    far = replace(b, position_mm=(b.position_mm[0] + 40_000, *b.position_mm[1:]))
    with pytest.raises(FitFailed) as refused:
        shared_area(a, a.image_size, far, far.image_size, FIELD)
    assert refused.value.reason == "no-overlap"


def test_a_smooth_field_of_any_degree_comes_back_from_its_own_values():
    places = rng(2).uniform(-1000, 1000, (60, 2))
    x, y = (places / 1000).T
    true = np.stack(
        [3 + 5 * x - 2 * y + 2 * x * x + 4 * x * y, -1 + y + 2 * x * y + 4 * y * y], axis=1
    )
    found = fit_offset_field(OffsetMeasurements.of_places(places, places + true))
    assert found.degree == 2 and np.abs(found.at(places + true / 2)[0] - true).max() < 0.05


def test_the_matrix_of_two_calibrations_puts_every_thing_on_its_line(models):
    pixels_a, pixels_b, _ = seen_by(models, z=(0.0, 1500.0))
    told = geometry(*models)
    matrix = np.array(told["matrix"])
    a, b = (
        np.column_stack([ideal_px(m, p) + np.array(m.centre_px), np.ones(len(p))])
        for m, p in zip(models, (pixels_a, pixels_b), strict=True)
    )
    line = a @ matrix.T
    assert np.abs(np.sum(b * line, axis=1) / np.linalg.norm(line[:, :2], axis=1)).max() < 1e-6
    assert told["baseline_mm"] == pytest.approx(
        np.linalg.norm(np.subtract(models[0].position_mm, models[1].position_mm))
    )
    by_matches = fundamental_matrix(a[:, :2], b[:, :2]).fundamental
    assert min(np.abs(matrix - s * by_matches).max() for s in (1, -1)) < 1e-5


def test_most_cameras_rectangles_are_the_common_ones():
    one, other = Rectangles(100.0, 80.0, 8, 10), Rectangles(120.0, 80.0, 8, 10)
    assert (
        most_common([other, one, one]) is one
        and most_common([other, one]) is other
        and most_common([]) is None
    )
    assert one.same_as(Rectangles(100.0 * (1 + 1e-12), 80.0, 8, 10)) and not one.same_as(
        replace(one, n_x=9)
    )
