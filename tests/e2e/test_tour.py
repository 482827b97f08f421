"""The tour and the ways into the manual: real panels, real numbers, left and gone on with; by mouse, key and finger."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.demo_cameras import HEIGHT, WIDTH
from tests.support.waiting import until
from tests.support.words import like, t, titled


def stops(page):
    """Go on through all of them from here; {stop: what its numbers say}."""
    seen = {}
    while page.get_by_test_id("tour").count():
        stop = page.get_by_test_id("tour").get_attribute("data-stop")
        expect(page.get_by_test_id("tour-ring")).to_be_visible(timeout=LONG_MS)
        if stop in ("verdict", "distortion", "residuals"):
            expect(page.get_by_test_id("tour-numbers")).not_to_contain_text("–", timeout=LONG_MS)
        seen[stop] = page.get_by_test_id("tour-numbers").inner_text()
        page.get_by_test_id("tour-ahead").click()
        expect(page.locator(f"[data-testid=tour][data-stop={stop}]")).to_have_count(0)
    return seen


def test_question_marks_and_the_tour_speak_of_the_picture_that_is_open(clicked, server):
    operator = clicked("brown-conrady")
    a_question_mark_opens_the_manual_at_its_heading(operator.unfold("inside").page)
    its_numbers_are_told(operator, server)
    what_it_speaks_of_is_brought_back(operator.page)


def a_question_mark_opens_the_manual_at_its_heading(page):
    page.get_by_test_id("explain-inside").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("manual")).to_have_attribute("data-page", "points.md")
    heading = page.locator("#manual-reading-the-results")
    expect(heading).to_be_in_viewport()
    expect(heading).to_be_focused()
    page.get_by_test_id("manual").get_by_role("button", name=t("help.manual.all-pages")).click()
    page.get_by_test_id("manual").get_by_role("link", name="Troubleshooting").click()
    expect(
        page.get_by_test_id("manual").get_by_role("heading", name="Troubleshooting")
    ).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("help-panel")).to_have_count(0)


def its_numbers_are_told(operator, server):
    page, draft = operator.page, operator.draft()
    body = {name: draft[name] for name in ("field", "region", "model", "options", "observations")}
    saved = server.api("POST", "/calibrations", json=body | {"snapshot": operator.snapshot}).json()
    page.reload()
    expect(page.get_by_test_id("verdict")).not_to_have_attribute("data-level", "", timeout=LONG_MS)
    page.keyboard.press("F2")
    seen = stops(page)
    assert len(seen) > 10
    assert f"{titled('markings.left')}\n{t('common.points', count=7)}" in seen["borders"].replace(
        "\t", "\n"
    )
    assert f"{saved['report']['verdict']['mm']:.1f} mm" in seen["verdict"]
    assert f"{saved['report']['rms_px']:.2f} px" in seen["residuals"]
    assert f"{WIDTH} × {HEIGHT} px" in seen["picture"]
    assert "%" in seen["distortion"]
    expect(page.get_by_test_id("tour")).to_have_count(0)


def what_it_speaks_of_is_brought_back(page):
    """When a late answer pushed it out of sight."""
    ring, verdict = page.get_by_test_id("tour-ring"), page.get_by_test_id("verdict")
    page.evaluate("localStorage.setItem('touchline-tour', JSON.stringify({ on: false, at: 4 }))")
    page.reload()
    expect(verdict).not_to_have_attribute("data-level", "", timeout=LONG_MS)
    page.keyboard.press("F2")
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "verdict")
    expect(verdict).to_be_in_viewport()
    expect(ring).to_be_visible()
    page.wait_for_timeout(600)  # it is brought into sight at first; this is about later
    page.evaluate("""document.querySelector('aside.right').prepend(
        Object.assign(document.createElement('p'), { style: 'height: 2000px', id: 'late' }))""")
    expect(page.locator("#late")).to_be_attached()
    expect(verdict).to_be_in_viewport()
    expect(ring).to_be_visible()
    page.locator("aside.right").hover()
    page.mouse.wheel(0, -5000)  # the operator's own scrolling is left alone
    expect(ring).to_have_count(0)
    page.evaluate("document.querySelector('#late').style.height = '2500px'")
    page.wait_for_timeout(600)  # for a look that must not scroll
    expect(verdict).not_to_be_in_viewport()


@pytest.mark.long
def test_the_tour_is_left_and_gone_on_with_where_it_was(operator):
    page = operator.page
    page.get_by_test_id("take-tour").click()
    page.get_by_test_id("tour-ahead").click()
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "picture")
    # and nothing is locked
    expect(page.get_by_test_id("tour-waits")).to_contain_text(like("help.tour.not-open"))
    page.get_by_test_id("tour-leave").click()
    expect(page.get_by_test_id("tour")).to_have_count(0)
    page.reload()
    resume = like("help.tour.resume", stop=2).pattern.replace(".*?", r"\d+")
    expect(page.get_by_test_id("take-tour")).to_contain_text(re.compile(resume))
    page.keyboard.press("F2")
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "picture")
    page.reload()
    # a reload does not end it
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "picture")
    # nor does the work wait for it: it goes on with it
    page.get_by_test_id("camera-overhead").click()
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "drawing", timeout=LONG_MS)
    expect(page.get_by_test_id("step-field")).to_have_attribute("aria-current", "step")
    ring = until(
        lambda: page.get_by_test_id("tour-ring").bounding_box(), lambda box: box is not None
    )
    drawing = page.locator("aside.right .field").bounding_box()
    for side in ("x", "y", "width"):  # about what it speaks of, as far down as that is in sight
        assert abs(ring[side] - drawing[side]) < 12, side


@pytest.mark.long
def test_by_finger_on_a_telephone_the_tour_stands_below_the_picture(browser, clicked, server):
    operator = clicked("division")
    context = browser.new_context(viewport={"width": 360, "height": 740}, has_touch=True)
    page = context.new_page()
    page.goto(operator.page.url)
    expect(page.get_by_test_id("borders")).to_be_attached(timeout=LONG_MS)
    page.get_by_test_id("help").tap()
    page.get_by_test_id("take-tour").tap()
    page.get_by_test_id("close-help").tap()
    # the cameras are not in sight
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "picture")
    page.get_by_test_id("tour-ahead").tap()
    expect(page.get_by_test_id("tour")).to_have_attribute("data-stop", "drawing")
    box = page.get_by_test_id("tour").bounding_box()
    assert box["x"] >= 0 and box["x"] + box["width"] <= 360
    context.close()
