"""Straight edges in pictures of the world: a facade, offices and corridors, an ice rink, a grid of lines."""

import cv2
import numpy as np
import pytest

from tests.support.plumb_pictures import department, picture, straightness_of
from tests.support.tiers import long, rounds
from touchline.core.geometry import ImageSize
from touchline.straight.fit import fit_plumb_lines
from touchline.straight.straightness import straightness
from touchline.vision.edges import edge_chains


def shrunk(pixels, by):
    return cv2.resize(pixels, None, fx=1 / by, fy=1 / by, interpolation=cv2.INTER_AREA)


@rounds("shrink", 4, 2, 1)
def test_the_facade_becomes_straight_to_a_fifth_of_a_pixel(shrink):
    report = straightness_of(shrunk(picture("ipol_alvarez/building.png"), shrink))
    assert report["distortion"] == "significant"
    assert report["straightness_px"]["before"] > 5 / shrink
    assert report["straightness_px"]["after"] <= 0.20
    roof = max(
        (
            line
            for line in report["lines"]
            if max(line["ends"][0][1], line["ends"][-1][1]) < 160 / shrink
        ),
        key=lambda line: line["length_px"],
    )
    # the longest is used
    assert roof["used"] and roof["before_px"] > 8 / shrink and roof["after_px"] < 0.3


@rounds("shrink", 2, 1)
def test_the_facade_as_others_corrected_it_has_no_significant_distortion(shrink):
    report = straightness_of(shrunk(picture("ipol_alvarez/building_division_model.png"), shrink))
    assert report["distortion"] == "none"
    assert "No significant distortion" in report["sentence"]
    assert (
        report["bow"]["longest"]["length_px"] > 1000 / shrink
        and report["bow"]["longest"]["px"] < 0.3
    )


@pytest.mark.parametrize(
    ("lens", "every", "shrink"),
    [("brown-conrady", 4, 2), long("brown-conrady", 2, 1), long("division-even", 2, 1)],
)
def test_every_picture_of_one_camera_finds_the_lens_of_all(lens, every, shrink):
    """At least nine in ten terms within 2 σ of the joint one's, none beyond 4 σ."""
    pictures, size = (
        [shrunk(p, shrink) for p in department()[::every]],
        ImageSize(800 // shrink, 600 // shrink),
    )
    sets = [edge_chains(p) for p in pictures]
    numbers = np.repeat(range(len(sets)), [len(s) for s in sets])
    joint = fit_plumb_lines([c for s in sets for c in s], size, lens, pictures=numbers)
    each = [fit_plumb_lines(s, size, lens) for s in sets]
    off = np.array([np.abs(f.values - joint.values)[:2] / f.sigma[:2] for f in each])
    assert joint.names[:2] == ("k1", "k2")
    assert (off < 2).mean() >= 0.9
    assert off.max() < 4
    assert joint.after_px < 0.25


@rounds("lens", "division", "auto")
def test_an_ice_rinks_curved_boards_do_not_break_the_search(lens):
    pixels = picture("hockey_video2calibration/distorted.png")
    report = straightness([edge_chains(pixels)], (), ImageSize(*pixels.shape[1::-1]), lens=lens)
    crooked = [line for line in report["lines"] if line["reason"] == "not-straight"]
    assert report["lines_used"] >= 5 and crooked  # rings and rounded boards
    assert report["straightness_px"]["after"] < 1


@pytest.mark.parametrize(("shrink", "lens"), [(2, "division"), long(1, "auto")])
def test_a_grid_of_lines_is_joined_across_its_crossings(shrink, lens):
    pixels = shrunk(picture("discorpy/line_pattern_01.jpg"), shrink)
    report = straightness([edge_chains(pixels)], (), ImageSize(*pixels.shape[1::-1]), lens=lens)
    assert report["bow"]["longest"]["length_px"] > 2000 / shrink
    assert report["straightness_px"]["after"] < 0.08 < report["straightness_px"]["before"]
