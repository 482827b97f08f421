"""A zoom that moves while views of a board are taken is seen in their order; an operator who walks is not."""

import numpy as np
import pytest

from tests.support.board_views import SIZE, views_of, walked, zoomed_views
from touchline.boards.fit import fit_board
from touchline.boards.report import board_report
from touchline.boards.uncertainty import FocalDrift
from touchline.models import MODELS

TERMS = {"terms": ["k1", "k2", "p1", "p2"]}
COUNT = 8


def drift(views):
    return FocalDrift.of(fit_board(views, SIZE, MODELS["brown-conrady"], TERMS))


def test_a_zoom_that_creeps_through_the_views_makes_the_lens_poor_with_a_cure():
    report = board_report(
        fit_board(zoomed_views(np.linspace(0, 0.03, COUNT)), SIZE, MODELS["brown-conrady"], TERMS)
    )
    assert report["verdict"]["level"] == "poor" and "zoom" in report["verdict"]["sentence"].lower()
    # half of the views against the other half
    assert report["focal_drift"]["pct"] == pytest.approx(1.6, abs=0.2)
    [warning] = [w for w in report["warnings"] if w["reason"] == "focal-length-changed"]
    assert "Lock zoom and focus" in warning["fix"]


def test_a_zoom_that_slips_once_is_told_with_its_sign_and_size():
    found = drift(zoomed_views(np.repeat([0.0, -0.01], COUNT // 2), seed=3))
    assert found.significant and found.change == pytest.approx(-0.01, rel=0.05)


@pytest.mark.parametrize("how", ["across", "away"])
def test_an_operator_who_walks_through_the_picture_changes_no_focal_length(how):
    found = drift(walked(views_of(count=COUNT, seed=2), how))
    assert not found.significant and 0 < found.sigma < 0.002


def test_what_only_the_order_tells_is_not_seen_in_another_order():
    """The same creeping views, first and last in turn: both halves then hold all focal lengths."""
    views = zoomed_views(np.linspace(0, 0.03, COUNT))
    turn = np.argsort(np.minimum(np.arange(COUNT), np.arange(COUNT)[::-1]), kind="stable")
    assert not drift(tuple(views[i] for i in turn)).significant


def test_five_views_are_too_few_to_tell():
    found = drift(views_of(count=5))
    assert np.isnan(found.change) and not found.significant
