"""Edges that bow by themselves are told from a lens that bows them, where both sides of the picture have edges."""

import pytest

from tests.support.straight_edges import SIZE, lens_of, level_lines, lines_seen
from touchline.straight.straightness import straightness

STRAIGHT = lens_of(terms=(0.0, 0.0))


def report_of(chains, **choices):
    return straightness((), chains, SIZE, **{"lens": "division", **choices})


@pytest.mark.parametrize(("sag", "side"), [(0.006, "bottom"), (-0.008, "top")])
def test_ropes_that_sag_on_both_sides_of_the_centre_are_no_lens(sag, side):
    report = report_of(level_lines(STRAIGHT, 0, sag=sag, lines=8))
    assert report["distortion"] == "unknown" and f"towards the {side}" in report["sentence"]
    assert report["edges_bow"]["pct"][1] == pytest.approx(100 * sag, abs=0.03)
    assert 0 < report["edges_bow"]["sigma_pct"][1] < 0.03


def test_a_bow_towards_the_side_is_told_as_well():
    turned = [
        chain[:, ::-1] for chain in level_lines(STRAIGHT, 2, sag=0.006, lines=8, reach=(0.3, 1.1))
    ]
    report = report_of(turned)
    assert report["edges_bow"] and "towards the right" in report["sentence"]


@pytest.mark.parametrize(
    ("terms", "centre"), [((0.06,), (0, 0)), ((-0.1, 0.02, 0.002, -0.002), (30, -50))]
)
def test_an_honest_lens_bows_edges_whatever_its_centre_and_its_tangential_terms(terms, centre):
    report = report_of(level_lines(lens_of(terms=terms, centre=centre), 1, lines=8))
    assert report["distortion"] == "significant" and report["edges_bow"] is None


def test_edges_on_one_side_of_the_centre_cannot_tell_the_lens_from_themselves():
    report = report_of(level_lines(lens_of(terms=(-0.06,)), 1, lines=8, reach=(0.6, 0.94)))
    assert report["distortion"] == "unknown" and report["edges_bow"] is None
    assert "cannot be tested" in report["sentence"] and "other side" in report["sentence"]


def test_a_centre_that_is_held_does_not_hide_ropes():
    report = report_of(level_lines(STRAIGHT, 0, sag=0.006, lines=8), centre_sigma_px=0)
    assert report["distortion"] != "significant"


def test_lines_all_over_the_picture_are_not_doubted():
    report = report_of(lines_seen(lens_of("division", (-0.25,), (0, 60)), 3))
    assert report["distortion"] == "significant"
