"""Every warning and refusal that something in the page can cure has a button that does it."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS

KNOWN_HEIGHT = {"value": 3000.0, "sigma": 30.0}


@pytest.fixture
def changed(clicked):
    """The demo's camera with its borders clicked, the clicks changed by a function, at a step."""
    def changed(model, change, step="borders", **options):
        operator = clicked(model, "borders", **options)
        draft = operator.draft()
        kept = {key: draft[key] for key in ("field", "region", "model", "options", "observations")}
        change(kept)
        snapshot = operator.snapshot
        operator.page.goto(f"{operator.server.url}/#/")
        expect(operator.page.get_by_test_id("camera-overhead")).to_be_visible()
        return operator.go_on(snapshot, kept, step)

    return changed


def left(draft):
    return next(o for o in draft["observations"] if o["feature"] == "left")


@pytest.mark.long
def test_too_few_points_on_a_border_take_the_operator_to_that_border(changed):
    page = changed("polynomial", lambda d: left(d).update(points=left(d)["points"][:2])).page
    page.get_by_test_id("border-top").click()
    expect(page.get_by_test_id("missing")).to_contain_text("left border", timeout=LONG_MS)
    page.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("border-left")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_a_point_clicked_twice_is_one_point_and_stops_nothing(changed):
    operator = changed("polynomial", lambda d: left(d)["points"].append(left(d)["points"][2]))
    page = operator.page
    expect(page.get_by_test_id("verdict")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("missing")).to_have_count(0)
    assert len(operator.points("left")) == 8  # as clicked


def test_a_stray_click_is_shown_and_removed(changed):
    def shift(draft):
        left(draft)["points"][4][0] += 30

    operator = changed("division", shift, height_mm=KNOWN_HEIGHT)
    page = operator.page
    warning = page.locator('[data-reason="stray-click"]')
    expect(warning).to_be_visible(timeout=LONG_MS)
    warning.get_by_test_id("show-stray").click()
    expect(page.locator('[data-point="left:4"]')).to_have_class(re.compile("picked"))
    warning.get_by_test_id("remove-stray").click()
    expect(warning).to_have_count(0, timeout=LONG_MS)
    assert len(operator.points("left")) == 6


@pytest.mark.long
def test_a_stray_of_a_saved_version_is_removed_from_the_compare_step(changed):
    def shift(draft):
        left(draft)["points"][4][0] += 30

    operator = changed("division", shift, "model", height_mm=KNOWN_HEIGHT).next("compare")
    operator.page.locator('[data-reason="stray-click"]').get_by_test_id("remove-stray").click()
    expect(operator.page.get_by_test_id("step-borders")).to_have_attribute("aria-current", "step")
    assert len(operator.points("left")) == 6


@pytest.mark.long
def test_a_border_whose_end_is_a_guess_is_clicked_there(changed):
    page = changed("polynomial", lambda d: left(d).update(points=left(d)["points"][:5])).page
    page.get_by_test_id("border-top").click()
    warning = page.locator('[data-reason="border-extrapolated"]').first
    expect(warning).to_contain_text("left border", timeout=LONG_MS)
    warning.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("border-left")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_an_inside_that_nobody_clicked_takes_the_operator_to_a_line_inside(clicked):
    page = clicked("polynomial", "borders").page
    warning = page.locator('[data-reason="inside-not-checked"]')
    page.get_by_text("more warning").click()
    expect(warning).to_be_visible()
    warning.get_by_test_id("cure-click").click()
    expect(page.get_by_test_id("inside-centre-circle")).to_have_attribute("aria-pressed", "true")


@pytest.mark.long
def test_a_map_that_a_model_cannot_have_leads_to_the_models(clicked):
    page = clicked("polynomial").next("compare").page
    page.keyboard.press("e")
    page.get_by_test_id("no-map-cure").click()
    expect(page.get_by_test_id("step-model")).to_have_attribute("aria-current", "step")
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
