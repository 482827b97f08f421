"""Straight edges in pictures of the world: a facade, offices and corridors, an ice rink, a grid of lines."""

import numpy as np
import pytest

from app.core.geometry import ImageSize
from app.fitting.plumb_line.fit import fit_plumb_lines
from app.vision.lines.edges import edge_chains
from tests.support.plumb_pictures import department, picture, straightness_of


def test_the_facade_becomes_straight_to_a_fifth_of_a_pixel():
    report = straightness_of(picture("ipol_alvarez/building.png"))
    assert report["distortion"] == "significant"
    assert report["straightness_px"]["before"] > 5
    assert report["straightness_px"]["after"] <= 0.20
    roof = max((line for line in report["lines"] if line["ends"][0][1] < 160 and line["ends"][-1][1] < 160),
               key=lambda line: line["length_px"])
    assert roof["used"] and roof["before_px"] > 8 and roof["after_px"] < 0.3  # the longest bow was not left out


def test_the_facade_as_others_corrected_it_has_no_significant_distortion():
    report = straightness_of(picture("ipol_alvarez/building_division_model.png"))
    assert report["distortion"] == "none"
    assert "No significant distortion" in report["sentence"]
    assert report["bow"]["longest"]["length_px"] > 1000 and report["bow"]["longest"]["px"] < 0.3


@pytest.fixture(scope="module")
def sets():
    """Chains of every second one of a camera's pictures: enough, and a fit of all takes a minute."""
    return [edge_chains(p) for p in department()[::2]]


@pytest.mark.parametrize("lens", ["division-even", "brown-conrady"])
def test_every_picture_of_one_camera_finds_the_lens_of_all(sets, lens):
    """At least nine in ten terms within 2 σ of the joint one's, none beyond 4 σ."""
    numbers = np.repeat(range(len(sets)), [len(s) for s in sets])
    joint = fit_plumb_lines([c for s in sets for c in s], ImageSize(800, 600), lens, pictures=numbers)
    each = [fit_plumb_lines(s, ImageSize(800, 600), lens) for s in sets]
    off = np.array([np.abs(f.values - joint.values)[:2] / f.sigma[:2] for f in each])
    assert joint.names[:2] == ("k1", "k2")
    assert (off < 2).mean() >= 0.9
    assert off.max() < 4
    assert joint.after_px < 0.25


def test_an_ice_rinks_curved_boards_do_not_break_the_search():
    report = straightness_of(picture("hockey_video2calibration/distorted.png"))
    crooked = [line for line in report["lines"] if line["reason"] == "not-straight"]
    assert report["lines_used"] >= 5 and crooked  # rings and rounded boards
    assert report["straightness_px"]["after"] < 1


def test_a_grid_of_lines_is_joined_across_its_crossings():
    report = straightness_of(picture("discorpy/line_pattern_01.jpg"))
    assert report["bow"]["longest"]["length_px"] > 2000
    assert report["straightness_px"]["after"] < 0.08 < report["straightness_px"]["before"]
