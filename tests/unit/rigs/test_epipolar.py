"""Epipolar lines as they are drawn: a match lies on its line, lines stay in the picture, lenses bend them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.exported import model_of, of_model
from tests.support.pairs import simulated
from touchline.core.geometry import ImageSize
from touchline.rigs.check import lines_by_calibrations
from touchline.rigs.evidence import (
    calibrated_epipolar_px,
    epipolar_curves,
    epipolar_segments,
    ideal_px,
)
from touchline.rigs.fundamental_matrix import fundamental_matrix
from touchline.rigs.verdict import of_calibrated, of_fundamental

SIZE = ImageSize(1280, 1024)


def away(points, lines):
    """(n,) px: how far each point is from the nearest part of its line (n, k, 2)."""
    start, step = lines[:, :-1], np.diff(lines, axis=1)
    share = np.clip(
        np.sum((points[:, None] - start) * step, axis=2) / np.sum(step**2, axis=2), 0, 1
    )
    return np.linalg.norm(points[:, None] - start - share[..., None] * step, axis=2).min(axis=1)


def test_a_match_lies_on_the_straight_line_of_its_fellow_both_ways():
    pair = simulated(0, mistakes=0.0, noise_px=0.01)
    found = fundamental_matrix(pair.a, pair.b).fundamental
    assert away(pair.b, epipolar_segments(found, pair.a, SIZE)).max() < 0.2
    assert away(pair.a, epipolar_segments(found.T, pair.b, SIZE)).max() < 0.2


def test_straight_lines_end_at_the_picture_and_one_that_misses_it_is_nan():
    upright, level, aside = [1.0, 0, -300], [0.0, 1, -200], [1.0, 0, -5000]
    lines = [
        epipolar_segments(np.column_stack([np.zeros((3, 2)), line]), np.zeros((1, 2)), SIZE)[0]
        for line in (upright, level, aside)
    ]
    assert sorted(map(tuple, lines[0])) == [(300, -0.5), (300, 1023.5)]
    assert sorted(map(tuple, lines[1])) == [(-0.5, 200), (1279.5, 200)]
    assert np.isnan(lines[2]).all()


@pytest.mark.parametrize("k", [0.0, -0.25])
def test_a_lens_bends_the_line_and_the_match_stays_on_it(k):
    pair = simulated(1, mistakes=0.0, noise_px=0.0, k=k)
    lines = epipolar_curves(pair.camera_a, pair.camera_b, pair.a)
    # px, of steps that are straight
    assert away(pair.b, np.where(np.isfinite(lines), lines, 1e9)).max() < 0.05
    ends = lines[:, [0, -1]]
    bow = away(lines[:, 32], ends)
    assert (bow.max() > 5) == (k != 0)


def test_a_line_that_is_nowhere_in_the_other_picture_is_nan():
    pair = simulated(0, mistakes=0.0)
    turned = replace(pair.camera_b, rotation=(0.0, 0.0, 0.0))  # looks up
    assert np.isnan(epipolar_curves(pair.camera_a, turned, pair.a[:3])).all()


def test_mistakes_among_matches_are_named_as_the_operator_counts_them():
    good = np.ones(30, bool)
    assert of_fundamental(np.full(30, 0.3), good, np.arange(30)) == {
        "level": "good",
        "sentence": "30 of 30 matches agree with one geometry, within 0.30 px.",
        "fix": "",
        "statements": {
            "sentence": [{"code": "pair.geometry", "values": {"n": 30, "all": 30, "px": 0.3}}]
        },
    }
    good[[4, 11]] = False
    told = of_fundamental(np.full(30, 0.3), good, np.arange(30))
    assert told["level"] == "fair" and told["sentence"].endswith("Matches 5 and 12 do not.")
    assert "too few" in of_fundamental(np.full(12, 0.3), np.ones(12, bool), np.arange(12))["fix"]


def test_a_moved_camera_and_a_single_mistake_are_told_apart():
    assert of_calibrated(np.full(9, 0.4), np.arange(9))["level"] == "good"
    assert (
        "camera was moved" in of_calibrated(np.array([8.0, 9, 7, np.nan, 8]), np.arange(5))["fix"]
    )
    assert of_calibrated(np.array([0.4, 0.5, 40.0, 0.3, np.nan]), np.arange(5) + 4)[
        "fix"
    ].startswith("Check match 7")


def test_calibrations_that_are_right_foretell_the_lines_and_one_knocked_does_not():
    pair = simulated(5, k=-0.2)
    assert (
        calibrated_epipolar_px(pair.camera_a, pair.camera_b, pair.clean_a, pair.clean_b).max()
        < 1e-6
    )
    knocked = replace(
        pair.camera_b, rotation=(pair.camera_b.rotation[0] + 0.01, *pair.camera_b.rotation[1:])
    )
    assert (
        np.median(calibrated_epipolar_px(pair.camera_a, knocked, pair.clean_a, pair.clean_b)) > 1.0
    )


def test_without_a_lens_ideal_pixels_are_the_pixels():
    pair = simulated(11)
    centre = np.array(pair.camera_a.centre_px)
    np.testing.assert_allclose(ideal_px(pair.camera_a, pair.a) + centre, pair.a, atol=1e-9)


def test_a_place_is_told_wherever_the_other_picture_shows_it_though_that_is_larger():
    large, size = model_of("brown-conrady", 0), ImageSize(640, 512)
    small = replace(large, image_size=size, focal_px=large.focal_px / 2, centre_px=size.centre)
    in_large = np.array([[1000.0, 800.0], [300.0, 200.0]])
    in_small = (in_large + 0.5) / 2 - 0.5
    found = lines_by_calibrations(of_model(large), of_model(small), in_large, in_small)
    np.testing.assert_allclose(np.array(found["place_in_a"], float), in_large, atol=1e-6)
    np.testing.assert_allclose(np.array(found["place_in_b"], float), in_small, atol=1e-6)
