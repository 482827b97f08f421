"""Choosing a model: all are compared on the same clicks, one is recommended, and every refusal says what to do."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.held_requests import holding, wait_until_held
from tests.support.waiting import jobs_so_far, newest_job
from tests.support.words import t

BORDERS = ("left", "right", "top", "bottom")
COMPARE = "**/api/v1/calibrations/compare?*"


def test_models_stand_in_the_order_of_their_error_and_the_recommended_one_is_a_click_away(
    page, clicked, tmp_path
):
    with holding(page, COMPARE, "POST"):
        operator = clicked("polynomial").open_lens()
        expect(page.get_by_test_id("comparing")).to_be_visible(timeout=LONG_MS)
        page.screenshot(path=tmp_path / "comparing.png")
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("comparing")).to_have_count(0, timeout=LONG_MS)
    shown = page.get_by_test_id("models").locator("td.value").all_inner_texts()
    errors = [
        float(text.split()[0].replace("\u202f", "")) for text in shown if text not in ("", "–")
    ]
    assert errors == sorted(errors)
    # the lens is a strong one, whichever model has it
    expect(page.get_by_test_id("no-distortion")).to_have_count(0)
    page.screenshot(path=tmp_path / "ranked.png")
    recommended = page.get_by_test_id("models").locator(
        "tbody", has_text=t("calibrate.model-table.recommended")
    )
    page.get_by_test_id("do-use-recommended").click()
    expect(recommended.get_by_role("button")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("do-use-recommended")).to_have_count(0)
    expect(page.get_by_test_id("model-details")).to_contain_text(
        t("calibrate.model-table.held-out")
    )
    assert operator.draft()["model"] != "polynomial"


@pytest.mark.long
def test_a_comparison_can_be_stopped_and_begun_again(clicked, server):
    before = jobs_so_far(server)
    page = clicked("division").open_lens().page
    page.get_by_test_id("do-stop-comparing").click()
    expect(page.get_by_test_id("not-compared")).to_be_visible()
    newest_job(server, "comparison", "cancelled", besides=before)
    expect(page.get_by_test_id("ranking")).to_have_count(0)
    page.get_by_test_id("do-compare-models").click()
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)


@pytest.mark.long
def test_who_leaves_the_step_stops_the_comparison_though_it_is_only_being_asked_for(
    page, clicked, server
):
    before = jobs_so_far(server)
    with holding(page, COMPARE, "POST") as asked:
        clicked("division").open_lens()
        wait_until_held(page, asked)
        page.get_by_test_id("step-field").click()
        expect(page.get_by_test_id("step-field")).to_have_attribute("aria-current", "step")
    newest_job(server, "comparison", "cancelled", besides=before)


@pytest.mark.long
def test_a_model_that_cannot_be_fitted_is_listed_with_what_to_do(clicked, tmp_path):
    page = clicked("division", painted="halfway-line").open_lens().page
    failed = page.get_by_test_id("failed-polynomial")
    expect(failed).to_contain_text(t("calibrate.model-table.cannot-be-fitted"), timeout=LONG_MS)
    expect(failed).to_contain_text("Click")
    page.screenshot(path=tmp_path / "failed.png")


@pytest.mark.long
def test_straight_lines_are_said_to_have_no_significant_distortion(
    operator, straight_picture, frame_points, tmp_path
):
    operator.open(straight_picture, "table", "full")
    for border in BORDERS:
        operator.click(border, frame_points[border])
    page = operator.open_lens().page
    expect(page.get_by_test_id("no-distortion")).to_contain_text(
        t("calibrate.model-table.no-distortion"), timeout=LONG_MS
    )
    page.screenshot(path=tmp_path / "straight.png")


@pytest.mark.long
def test_a_taped_height_stays_when_another_model_is_chosen(clicked):
    operator = clicked(
        "brown-conrady", height_mm={"value": 3000.0, "sigma": 30.0}, terms=["k1"]
    ).open_lens()
    operator.page.get_by_test_id("model-division").click()
    assert operator.draft()["options"] == {"height_mm": {"value": 3000.0, "sigma": 30.0}}
    operator.page.get_by_test_id("model-polynomial").click()
    assert operator.draft()["options"] == {}


@pytest.mark.long
@pytest.mark.parametrize("size", [(1280, 800), (1024, 768)], ids=["laptop", "tablet"])
@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_nothing_of_maps_and_models_is_cut_off(clicked, tmp_path, size, scheme):
    operator = clicked("brown-conrady", height_mm={"value": 3000.0, "sigma": 30.0}).open_lens()
    page = operator.page
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.keyboard.press("0")
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=tmp_path / "models.png")
    operator.next("verify")
    page.keyboard.press("e")
    expect(page.get_by_test_id("heat-figures")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("corrected").evaluate("picture => picture.decode()")
    page.screenshot(path=tmp_path / "map.png")
    for shown in ("legend", "do-heat", "next"):
        box = page.get_by_test_id(shown).first.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0] + 0.5, shown
    overflowing = page.evaluate(
        "[...document.querySelectorAll('aside, .verdict, footer')]"
        ".filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName)"
    )
    assert overflowing == []
