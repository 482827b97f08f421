"""Residuals in plots: what is pointed at there is ringed in the picture, and the other way round."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, shift_one
from tests.support.waiting import until
from tests.support.words import like, t, titled


@pytest.fixture
def astray(clicked):
    """Division model on the demo's camera, clicked by a hand, with a stray click."""
    operator = clicked("division", shift_one)
    in_one_line = operator.page.get_by_test_id("fold-residuals")
    value = like("calibrate.residuals.value").pattern.replace(".*?", r"[\d.]+")
    expect(in_one_line).to_contain_text(re.compile(value), timeout=LONG_MS)
    expect(operator.page.get_by_test_id("residuals")).to_have_count(0)  # until it is opened
    operator.unfold("residuals")
    expect(operator.page.get_by_test_id("residuals")).to_be_visible(timeout=LONG_MS)
    expect(operator.page.get_by_test_id("residual-said")).to_contain_text(
        t("common.strays", count=1), timeout=LONG_MS
    )
    # The whole fit is there.
    expect(operator.page.locator('[data-reason="stray-click"]')).to_be_visible(timeout=LONG_MS)
    return operator


def said(page):
    return page.get_by_test_id("residual-said")


def test_what_is_pointed_at_in_the_plot_is_ringed_in_the_picture_selected_and_told(
    astray, tmp_path
):
    page = astray.page
    plot = page.get_by_test_id("residuals")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.55 * box["width"], box["y"] + 0.5 * box["height"])
    ring = page.get_by_test_id("hovered").locator("circle")
    expect(ring).to_have_count(1)
    feature, index = ring.get_attribute("data-of").split(":")
    expect(said(page)).to_contain_text(
        t("common.point-of", feature=titled(f"markings.{feature}"), number=int(index) + 1)
    )
    x, y = astray.spot(*astray.points(feature)[int(index)])
    on_screen = ring.bounding_box()
    centre = on_screen["x"] + on_screen["width"] / 2, on_screen["y"] + on_screen["height"] / 2
    assert centre == pytest.approx((x, y), abs=1)
    page.screenshot(path=tmp_path / "pointed.png")
    page.mouse.down()
    page.mouse.up()
    expect(page.locator(f'[data-point="{feature}:{index}"]')).to_have_class("point picked")
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] - 60)
    expect(ring).to_have_count(0)
    told_in_px_and_mm(astray)


def told_in_px_and_mm(astray):
    """As the server has them."""
    page = astray.page
    draft = astray.draft()
    body = {key: draft[key] for key in ("field", "region", "model", "options", "observations")}
    report = astray.server.api(
        "POST", "/fit/preview", json={**body, "snapshot": astray.snapshot}
    ).json()["report"]
    right = next(f for f in report["per_feature"] if f["feature"] == "right")["residuals"]
    x, y = astray.spot(*astray.points("right")[1])
    page.mouse.move(x, y)
    mm = right[1]["mm"]
    told = f"{mm:.0f}" if mm >= 10 else f"{mm:.1f}" if mm >= 0.05 else "< 0.1"
    expect(said(page)).to_contain_text(f"{right[1]['px']:.2f} px, {told} mm")
    page.get_by_test_id("unit-mm").click()
    expect(page.get_by_test_id("residuals")).to_have_attribute("aria-label", re.compile(r"\bmm\b"))


@pytest.mark.long
def test_what_is_pointed_at_in_the_picture_stands_in_the_plot(astray):
    page = astray.page
    x, y = astray.spot(*astray.points("top")[2])
    page.mouse.move(x + 3, y + 2)
    expect(said(page)).to_contain_text(
        t("common.point-of", feature=titled("markings.top"), number=3)
    )
    # left and right come before
    expect(page.get_by_test_id("residuals")).to_have_attribute("data-at", str(7 + 7 + 2))
    page.mouse.move(x, y + 120)
    expect(page.get_by_test_id("residuals")).to_have_attribute("data-at", "-1")


@pytest.mark.long
def test_the_keyboard_goes_from_click_to_click_and_selects(astray):
    page = astray.page
    page.get_by_test_id("residuals").focus()
    page.keyboard.press("Home")
    expect(page.get_by_test_id("residuals")).to_have_attribute("data-at", "0")
    first = page.get_by_test_id("residuals").get_attribute("aria-valuetext")
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("residuals")).not_to_have_attribute("aria-valuetext", first)
    expect(page.get_by_test_id("residuals")).to_have_attribute("data-at", "1")
    of = page.get_by_test_id("hovered").locator("circle").get_attribute("data-of")
    page.keyboard.press("Enter")
    expect(page.locator(f'[data-point="{of}"]')).to_have_class("point picked")


@pytest.mark.long
def test_a_key_is_not_undone_by_figures_that_came_just_before_it(astray):
    """The plot takes new figures over after the page is painted: on a busy machine that is after the next key."""
    page, plot = astray.page, astray.page.get_by_test_id("residuals")
    page.get_by_test_id("stage").focus()
    page.keyboard.press("n")
    expect(page.locator("[data-point].picked")).to_have_count(1)
    plot.focus()
    page.keyboard.press("Home")
    expect(plot).to_have_attribute("data-at", "0")
    line = plot.locator(".u-cursor-x")
    # drawn there
    until(lambda: line.evaluate("line => new DOMMatrix(line.style.transform).e"), lambda x: x >= 0)
    plot.evaluate("""async plot => {
      const how = { bubbles: true, cancelable: true };
      const press = (on, key) => on.dispatchEvent(new KeyboardEvent("keydown", { key, ...how }));
      press(document.body, "ArrowDown"); // moves the picked point: other figures
      for (let i = 0; i < 20; i++) await null; // rendered, but not painted
      press(plot, "ArrowRight");
    }""")
    until(lambda: line.evaluate("line => new DOMMatrix(line.style.transform).e"), lambda x: x > 0)
    expect(plot).to_have_attribute("data-at", "1")


@pytest.mark.long
def test_the_histogram_counts_every_click_but_strays_and_rings_those_of_a_bar(astray, tmp_path):
    page = astray.page
    page.get_by_test_id("plot-histogram").click()
    plot = page.get_by_test_id("histogram")
    plot.focus()
    page.keyboard.press("Home")
    expect(plot).not_to_have_attribute("data-at", "-1")
    counts, last = {}, ""
    while (place := plot.get_attribute("data-at")) != last:  # the last bar is kept
        count = int(plot.get_attribute("aria-valuetext").split()[0])
        assert count > 0  # an empty bar is passed over
        expect(page.get_by_test_id("hovered").locator("circle")).to_have_count(count)
        counts[place], last = count, place
        page.keyboard.press("ArrowRight")
    assert sum(counts.values()) == 4 * 7 - 1
    page.screenshot(path=tmp_path / "histogram.png")


@pytest.mark.long
def test_a_saved_versions_residuals_and_distortion_stand_in_the_compare_step(astray):
    operator = astray.next("verify").unfold("distortion")
    page = operator.page
    expect(page.get_by_test_id("residuals")).to_be_visible(timeout=LONG_MS)
    before = operator.saved()["report"]["distortion"]["per_border"]["left"]["before_pct"]
    shown = page.get_by_test_id("distortion-left").locator("em").inner_text()
    assert float(shown.split()[0].replace("−", "-")) == pytest.approx(before, abs=0.006)
    expect(page.get_by_test_id("distortion-left").locator(".band")).to_be_visible()
