"""The palette finds places, cameras, images, manual pages and commands."""

import re

from playwright.sync_api import expect

from tests.support.words import t


def find(page, words: str) -> None:
    """Look for it, take the first that is found, and return once the palette is closed."""
    page.keyboard.press("Control+k")
    page.get_by_test_id("palette-input").fill(words)
    expect(page.get_by_test_id("found").first).to_be_visible()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("palette")).to_have_count(0)


def test_whatever_there_is_is_found_by_a_few_letters_from_anywhere(
    operator, server, straight_picture
):
    page = operator.page
    name = server.api("GET", "/cameras/overhead").json()["name"]
    find(page, f"{name} {t('shell.view.drift')}".lower())
    expect(page).to_have_url(re.compile("#/cameras/overhead/drift$"))
    find(page, f"{t('shell.palette.kind.field').lower()} division b")
    expect(page.get_by_test_id("field-editor")).to_be_visible()
    find(page, t("shell.view.publishing").lower())
    expect(page.get_by_test_id("publishing-page")).to_be_visible()
    find(page, f"{t('shell.palette.kind.manual').lower()} drift")
    expect(page.get_by_test_id("manual")).to_have_attribute("data-page", "drift.md")
    picture = page.get_by_test_id("manual").get_by_role("link").filter(has=page.locator("img"))
    small = picture.locator("img").evaluate(
        "async (it) => { await it.decode(); return [it.width, it.naturalWidth]; }"
    )
    with page.context.expect_page() as opened:
        picture.click()
    assert opened.value.url.endswith("help/img/drift.webp") and small[0] < small[1] / 2
    opened.value.close()
    page.get_by_test_id("network-group").focus()  # not a key of the field's own
    page.keyboard.press("Control+k")
    page.get_by_test_id("palette-input").fill("no such thing")
    expect(page.get_by_test_id("found")).to_have_count(0)
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("palette")).to_have_count(0)
    expect(page.get_by_test_id("network-group")).to_be_focused()
    operator.open(straight_picture, "table", "full").click("left", [[80, 100]])
    assert len(operator.points("left")) == 1
    find(page, t("common.undo").lower())  # a command, and one that can be done here alone
    assert operator.points("left") == []
    page.get_by_test_id("search").click()
    page.get_by_test_id("palette-input").fill(straight_picture.name)
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowUp")
    page.get_by_test_id("found").filter(has_text=t("shell.palette.kind.image")).first.click()
    operator.is_at("points")


def test_the_manual_is_in_sight_on_a_telephone(operator):
    page = operator.page
    page.set_viewport_size({"width": 360, "height": 740})
    page.get_by_test_id("help").click()
    page.get_by_test_id("manual").get_by_role("link", name="Calibrating a camera").click()
    heading = page.get_by_role("heading", name="Calibrating a camera")
    expect(heading).to_be_in_viewport()
    page.get_by_test_id("manual").locator("img").evaluate("picture => picture.decode()")
    below, over = page.get_by_test_id("next").bounding_box(), heading.bounding_box()
    assert 0 < over["y"] < below["y"] / 2
    reached = page.evaluate(
        "y => document.elementFromPoint(180, y).closest('.manual') !== null", below["y"] - 10
    )
    assert reached, "down to the button"
