"""Raw against corrected on a live camera: both of the very same frame, under one view, lines and grid over both."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.demo_cameras import CAMERAS, WIDTH
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import like


@pytest.fixture
def live(saved, server):
    """The live page of the demo's first camera, with an active calibration."""
    operator = saved("brown-conrady", height_mm={"value": 3000.0, "sigma": 30.0})
    version = operator.saved()["id"]
    activate_despite(server, version)
    camera = CAMERAS[0]["id"]
    with operator.page.expect_response(
        lambda told: told.url.endswith("/status") and version in told.text(),
        # until then the version before is the active one
        timeout=LONG_MS,
    ):
        # from a picture, by its address alone
        operator.page.goto(f"{server.url}/#/cameras/{camera}/live")
    with operator.page.expect_request("**/cameras/status", timeout=LONG_MS):
        pass  # it is asked again once that answer was taken
    operator.camera = camera
    expect(operator.page.get_by_test_id("look-wipe")).to_be_enabled(timeout=LONG_MS)
    return operator


def compared(operator, mode):
    page = operator.page
    page.get_by_test_id(f"look-{mode}").click()
    expect(page.get_by_test_id(f"live-{operator.camera}")).not_to_have_attribute(
        "data-compared", "", timeout=LONG_MS
    )
    return page


def drawn(page, which):
    """How large what is drawn of one picture is, px."""
    return (
        page.get_by_test_id(f"live-{which}").locator("canvas").evaluate("c => [c.width, c.height]")
    )


def boxes(page):
    return [page.get_by_test_id(name).bounding_box() for name in ("live-raw", "live-corrected")]


@pytest.mark.long
def test_live_pictures_stand_side_by_side_and_zoom_together(live, tmp_path):
    page = compared(live, "side")
    # Half of 1600, and the gap; with the frames of that size the pictures lie where they stay.
    until(
        lambda: (drawn(page, "raw")[0], drawn(page, "corrected")[0]),
        lambda widths: widths == (798, 798),
    )
    before = boxes(page)
    stage = page.get_by_test_id(f"live-{live.camera}").bounding_box()
    assert before[0]["x"] + before[0]["width"] <= stage["x"] + stage["width"] / 2 + 1
    assert before[1]["x"] >= stage["x"] + stage["width"] / 2 - 1
    page.mouse.move(stage["x"] + 0.75 * stage["width"], stage["y"] + 0.5 * stage["height"])
    page.mouse.wheel(0, -500)
    after = until(lambda: boxes(page), lambda now: now[0]["width"] > 1.5 * before[0]["width"])
    assert after[0]["width"] / before[0]["width"] == pytest.approx(
        after[1]["width"] / before[1]["width"], rel=1e-3
    )
    expect(page.get_by_test_id("counterpart-image")).to_be_visible()
    expect(page.get_by_test_id("live-read-out")).to_contain_text(
        like("live.compare.pixel-corrected")
    )
    page.screenshot(path=tmp_path / "side.png")
    page.keyboard.press("0")
    until(
        lambda: boxes(page)[0]["width"],
        lambda width: width == pytest.approx(before[0]["width"], abs=1),
    )


@pytest.mark.long
def test_live_pictures_are_wiped_with_field_lines_and_grid_over_both(live, tmp_path):
    page = compared(live, "wipe")
    page.get_by_test_id("look-lines").click()
    page.keyboard.press("g")
    expect(page.get_by_test_id("grid-raw")).to_be_visible()
    expect(page.get_by_test_id("grid-corrected")).to_be_visible()
    expect(page.get_by_test_id("field-lines")).to_have_count(2)
    before = int(page.get_by_test_id(f"live-{live.camera}").get_attribute("data-seq"))
    expect(page.get_by_test_id(f"live-{live.camera}")).not_to_have_attribute(
        "data-seq", str(before), timeout=LONG_MS
    )
    bar = page.get_by_test_id("wipe")
    bar.focus()
    share = int(bar.get_attribute("aria-valuenow"))
    page.keyboard.press("ArrowRight")
    expect(bar).to_have_attribute("aria-valuenow", str(share + 2))
    page.screenshot(path=tmp_path / "wipe.png")


@pytest.mark.long
def test_live_pictures_blink(live):
    page = compared(live, "blink")
    first = page.get_by_test_id("blink-legend").get_attribute("data-showing")
    expect(page.get_by_test_id("blink-legend")).not_to_have_attribute("data-showing", first)
    page.keyboard.press("r")  # the same keys as on a still
    expect(page.get_by_test_id("look-raw")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("blink-legend")).to_have_count(0)


def test_the_active_calibration_is_checked_against_the_picture_of_now_by_one_key(live):
    page = live.page
    page.get_by_test_id("look-lines").click()
    expect(
        page.get_by_test_id(f"live-{live.camera}").locator("svg path:not(.casing)").nth(4)
    ).to_be_attached(timeout=LONG_MS)
    expect(page.get_by_test_id("look")).to_contain_text("%", timeout=LONG_MS)
    manual_picture(page, "live")
    page.get_by_test_id("tab-drift").click()
    expect(page.get_by_test_id("do-check-calibration")).to_be_enabled(timeout=LONG_MS)
    verdict = page.get_by_test_id("check-verdict")
    page.keyboard.press("F4")
    expect(verdict).to_have_attribute(
        "data-reason", re.compile("holds|moved|lens|as-made"), timeout=2 * LONG_MS
    )
    expect(page.get_by_test_id("line-touch-line-top")).to_contain_text("%")
    expect(page.get_by_test_id("checked-picture").locator("circle.expected").first).to_be_attached()
    checked = page.get_by_test_id("checked-picture")
    expect(checked.locator("img")).to_have_js_property("naturalWidth", WIDTH, timeout=LONG_MS)
    checked.scroll_into_view_if_needed()
    manual_picture(page, "checking")
    page.get_by_test_id("close-check").click()
    expect(verdict).to_have_count(0)
