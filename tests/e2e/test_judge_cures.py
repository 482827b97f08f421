"""Every warning and refusal that something in the page can cure has a button that does it."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, clicks_left, shift_one
from tests.support.manual_pictures import manual_picture
from tests.support.words import like, t

KNOWN_HEIGHT = {"value": 3000.0, "sigma": 30.0}


def with_left(count):
    """A change of the draft: no more than so many points on the left border."""

    def change(draft):
        del clicks_left(draft)[count:]

    return change


@pytest.mark.long
def test_too_few_points_on_a_border_take_the_operator_to_that_border(clicked):
    page = clicked("polynomial", with_left(2)).page
    page.get_by_test_id("border-top").click()
    expect(page.get_by_test_id("missing")).to_contain_text(t("markings.left"), timeout=LONG_MS)
    page.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("border-left")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_a_point_clicked_twice_is_one_point_and_stops_nothing(clicked):
    operator = clicked("polynomial", lambda draft: clicks_left(draft).append(clicks_left(draft)[2]))
    page = operator.page
    expect(page.get_by_test_id("verdict")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("missing")).to_have_count(0)
    assert len(operator.points("left")) == 8  # as clicked


def test_a_stray_click_is_shown_and_removed(clicked):
    operator = clicked("division", shift_one, height_mm=KNOWN_HEIGHT)
    page = operator.page
    warning = page.locator('[data-reason="stray-click"]')
    expect(warning).to_be_visible(timeout=LONG_MS)
    manual_picture(page, "warnings")
    warning.get_by_test_id("show-stray").click()
    expect(page.locator('[data-point="left:4"]')).to_have_class(re.compile("picked"))
    warning.get_by_test_id("remove-stray").click()
    expect(warning).to_have_count(0, timeout=LONG_MS)
    assert len(operator.points("left")) == 6


@pytest.mark.long
def test_a_stray_of_a_saved_version_is_removed_from_the_compare_step(clicked):
    operator = clicked("division", shift_one, height_mm=KNOWN_HEIGHT).next("verify")
    operator.page.locator('[data-reason="stray-click"]').get_by_test_id("remove-stray").click()
    expect(operator.page.get_by_test_id("step-points")).to_have_attribute("aria-current", "step")
    assert len(operator.points("left")) == 6


@pytest.mark.long
def test_a_border_whose_end_is_a_guess_is_clicked_there(clicked):
    page = clicked("polynomial", with_left(5)).page
    page.get_by_test_id("border-top").click()
    warning = page.locator('[data-reason="border-extrapolated"]').first
    expect(warning).to_contain_text(t("markings.left"), timeout=LONG_MS)
    warning.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("border-left")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_an_inside_that_nobody_clicked_takes_the_operator_to_a_line_inside(clicked):
    page = clicked("polynomial").page
    warning = page.locator('[data-reason="inside-not-checked"]')
    page.get_by_text(
        re.compile(
            "|".join(
                like("calibrate.warnings.more", **how_many).pattern
                for how_many in ({}, {"count": 1})
            )
        )
    ).click()
    expect(warning).to_be_visible()
    warning.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("inside-centre-circle")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_a_map_that_a_model_cannot_have_leads_to_the_models(clicked):
    page = clicked("polynomial").next("verify").page
    page.keyboard.press("e")
    page.get_by_test_id("no-map-cure").click()
    expect(page.get_by_test_id("step-points")).to_have_attribute("aria-current", "step")
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
